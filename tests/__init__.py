"""The tests, and the makers of data sets, robots and rows that they share."""
