"""Bags as files: MCAP and sqlite3, read, written, repaired."""
