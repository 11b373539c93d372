"""Where a hand is in a frame when nothing is known about it."""
