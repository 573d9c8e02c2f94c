"""The page of the ontology's terms."""
