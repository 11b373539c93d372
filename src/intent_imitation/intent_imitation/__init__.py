"""Intention and the robot's own table to the object and the grasp that serve it (Sec. IV-D)."""
