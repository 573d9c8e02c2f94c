"""Robots that are watched: their samples into storage, the graph kept current."""
