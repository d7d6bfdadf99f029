"""The ROS 2 nodes: callbacks convert, the core computes, results are converted back."""
