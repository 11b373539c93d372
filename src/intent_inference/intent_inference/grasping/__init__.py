"""Hands that grasp: joint tables, hypotheses, closing, contacts."""
