"""Between ROS messages and the values of the core, in both directions."""
