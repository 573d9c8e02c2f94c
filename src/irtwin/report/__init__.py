"""Pages that open offline, every number of which answers a question put to the graph."""
