"""The questions to the graph that have a name, one SPARQL file each, and any other."""
