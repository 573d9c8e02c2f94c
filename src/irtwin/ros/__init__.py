"""What ROS takes of a robot: a package."""
