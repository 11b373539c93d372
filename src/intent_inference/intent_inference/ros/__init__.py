"""The only place of this package that knows ROS: conversions and the node."""
