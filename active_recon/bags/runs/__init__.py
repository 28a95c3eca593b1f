"""Bags as runs: the views of an episode, its parameters, its goals."""
