"""The nodes of clearway in ROS 2."""
