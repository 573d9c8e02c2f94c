"""The data sets that ship, and the plant that makes them."""
