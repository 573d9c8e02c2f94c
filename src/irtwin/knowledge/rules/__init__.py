"""Rules: read from SHACL or SWRL, run as SPARQL, written in SWRL for other tools."""
