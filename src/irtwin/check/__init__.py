"""What is wrong with a log, before any physics is fitted to it."""
