"""Nodes that ROS hides: short-lived ones of tools, mostly."""


def is_hidden(node: str) -> bool:
    """Return whether ROS hides a node of this full name, or its namespace."""
    return '/_' in node
