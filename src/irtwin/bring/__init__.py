"""Logs and robots of others, brought into a data set."""
