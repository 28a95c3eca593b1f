"""The full names of a node's topics, as a parameter that recorder and viewer read."""

from collections.abc import Iterable, Mapping

from active_recon.nodes.runtime.parameters import set_read_only_parameter
from rclpy.node import Node

TRANSPORT_SUFFIXES = {'camera/image_raw': ('', '/compressed'),
                      'camera/depth/image_raw': ('', '/compressedDepth')}
"""Suffixes of the topics that carry the same images, one for each transport."""
NAMES = 'names'
"""The parameter: a list of NAME:=TOPIC, the node's own name and the full name."""


def publish_topic_names(node: Node, names: Iterable[str]) -> None:
    """Set the parameter to the full names of topics after remapping, of every transport."""
    set_read_only_parameter(
        node, NAMES, [f'{name}{suffix}:={_full(node, name, suffix)}'
                      for name in names for suffix in TRANSPORT_SUFFIXES.get(name, ('',))],
        'full names of the topics, each as NAME:=TOPIC')


def _full(node: Node, name: str, suffix: str) -> str:
    """Return where a transport is: its own remapping follows that of the raw topic."""
    return node.resolve_topic_name(f'{node.resolve_topic_name(name)}{suffix}')


def full_names(parameters: Mapping[str, object]) -> dict[str, str]:
    """Return the full names in a node's parameters, by the node's own names."""
    value = parameters.get(NAMES)
    entries = value if isinstance(value, list | tuple) else ()
    pairs = (str(entry).partition(':=') for entry in entries)
    return {name: full for name, given, full in pairs if given}
