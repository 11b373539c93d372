"""Fitting the model to a frame: objective, swarm, least squares, the hand's size."""
