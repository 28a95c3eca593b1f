"""Bags as files: reading, writing and repairing MCAP, reading sqlite3."""
