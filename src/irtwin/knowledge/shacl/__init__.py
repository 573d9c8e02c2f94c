"""SHACL: constraints that the graph keeps, and rules that conclude."""
