"""What writes systems in the forms that ROS 2 reads: parameters, override files, code."""
