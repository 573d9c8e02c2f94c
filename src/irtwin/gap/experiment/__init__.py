"""What to measure next, so that effects which these data cannot tell apart can be told."""
