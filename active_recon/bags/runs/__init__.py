"""Bags as runs: episodes with their views and goals, and the parameters of the nodes."""
