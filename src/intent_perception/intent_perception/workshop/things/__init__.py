"""Parametric makers of the shipped objects and of clutter."""
