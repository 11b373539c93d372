"""A frame before any object is known: table, pixels above it, arms, the camera's pose."""
