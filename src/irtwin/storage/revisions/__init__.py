"""Revisions of the tables, one file each in `versions/`, as Alembic reads them."""
