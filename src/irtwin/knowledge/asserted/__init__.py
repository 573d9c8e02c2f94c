"""What users assert: read as facts, tried before it is taken, and brought back into the graph."""
