"""Archives of bags: each is replayed, reported or measured, into one table and one page."""
