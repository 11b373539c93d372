"""What stands in for the command `ros2` where no installation brings it."""
