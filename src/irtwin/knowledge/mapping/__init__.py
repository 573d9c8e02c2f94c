"""R2RML: tables become individuals as mapping documents say."""

from irtwin.knowledge.mapping.processor import map_database, map_to_file

__all__ = ["map_database", "map_to_file"]
