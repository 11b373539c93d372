"""Grasp features to the probability of each task (Sec. II, IV-A to IV-C)."""
