"""Fault isolation: which effects explain the gap, which of them cannot be told apart, and how sure that is."""
