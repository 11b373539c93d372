"""The objects that the system knows: their meshes, symmetries, resting poses and files."""
