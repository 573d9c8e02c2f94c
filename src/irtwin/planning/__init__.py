"""Motions from pose to pose: a path around obstacles, its timing within all limits, and what it costs."""
