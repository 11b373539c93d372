"""Explanations of the frames: where they come from and how they are judged."""
