"""What practises, executes and measures the robot's grasps; no robot runs it."""
