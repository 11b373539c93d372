"""From a reach or a grasp to the probability of each task (Sec. IV-C)."""
