"""Pages that open offline. Every number answers a question put to the graph; curves lie in files that it names."""
