"""Simulated grasps of any hand on any closed mesh, labelled with the tasks they afford."""
