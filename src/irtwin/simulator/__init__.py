"""The robot's model in a simulator: read, held against the robot, and written back with the numbers found."""
