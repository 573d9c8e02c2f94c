"""The bridge: physics as data providers of the knowledge graph."""
