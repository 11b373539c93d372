"""The only place of this package that knows ROS: conversions, nodes and what all nodes share."""
