"""The parameters of each node, as data."""
