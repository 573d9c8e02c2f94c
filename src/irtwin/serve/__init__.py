"""The SPARQL endpoint: protocol, workers, query page, the ontology by its IRIs."""
