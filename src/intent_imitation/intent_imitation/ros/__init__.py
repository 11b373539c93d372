"""The only place of this package that knows ROS: conversions and nodes."""
