"""Rendered table-top scenes with a camera's noise."""
