"""HTML reports from queries."""
