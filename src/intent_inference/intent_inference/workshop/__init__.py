"""What simulates grasps, trains and judges the networks; no robot runs it."""
