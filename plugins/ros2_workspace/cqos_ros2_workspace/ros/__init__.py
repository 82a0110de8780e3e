"""C-QoS among the tools of ROS 2: the command `ros2 qos` and the linter `ament_cqos`."""
