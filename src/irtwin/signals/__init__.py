"""Logs as read, and motions conditioned for identification."""
