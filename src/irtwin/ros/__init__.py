"""What ROS takes of a robot and its runs: a package, and bags."""
