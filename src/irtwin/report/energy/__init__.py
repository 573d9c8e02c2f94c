"""The page of a robot's energy."""
