"""R2RML: tables become individuals as mapping documents say."""

from irtwin.knowledge.mapping.incremental import refresh
from irtwin.knowledge.mapping.processor import map_database, map_to_file
from irtwin.knowledge.mapping.rows import RowMapper

__all__ = ["RowMapper", "map_database", "map_to_file", "refresh"]
