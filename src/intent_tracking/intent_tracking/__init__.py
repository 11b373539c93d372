"""Frames and objects to the state of hand and objects, and stable grasps (Sec. III-B, Table I)."""
