"""R2RML: tables become individuals as mapping documents say."""

from irtwin.knowledge.mapping.incremental import refresh
from irtwin.knowledge.mapping.processor import RowMapper, map_database, map_to_file

__all__ = ["RowMapper", "map_database", "map_to_file", "refresh"]
