"""The pages of a plant: all robots, one of them, a run, two of them side by side, and any individual."""
