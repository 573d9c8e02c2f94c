"""The relational database and the series beside it."""
