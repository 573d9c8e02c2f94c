"""Alarms of the graph, told to people: each once when it begins, and once when it is over."""
