"""ROS 2 as a link of `live.link`: topics over DDS, or by rclpy where ROS is there."""
