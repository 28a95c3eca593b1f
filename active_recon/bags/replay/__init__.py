"""Replaying runs and comparing them with the recording."""
