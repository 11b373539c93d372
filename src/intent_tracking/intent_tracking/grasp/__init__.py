"""The stable grasp and its features (Table I)."""
