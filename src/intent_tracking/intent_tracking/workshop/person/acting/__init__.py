"""What the demonstrator does: how it grasps, reaches and moves, by a script."""
