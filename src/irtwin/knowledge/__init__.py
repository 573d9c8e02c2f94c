"""The knowledge graph: store, mapping, reasoning, rules, queries."""
