"""The virtual robot."""
