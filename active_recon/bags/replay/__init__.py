"""Runs computed anew, and compared with what was recorded."""
