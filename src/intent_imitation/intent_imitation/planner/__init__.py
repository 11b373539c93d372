"""From the inferred task to an object and a grasp of the robot's own hand (Sec. IV-D)."""
