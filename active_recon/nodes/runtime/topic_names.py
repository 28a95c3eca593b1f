"""The full names of a node's topics, told as a parameter to who records or watches it."""

from collections.abc import Iterable, Mapping

from active_recon.nodes.runtime.parameters import tell
from rclpy.node import Node

FORMS = {'camera/image_raw': ('', '/compressed')}
"""What the topics of the same images end in, where they come in several forms."""
NAMES = 'names'
"""The parameter: each as NAME:=TOPIC, what the node calls it and its full name."""


def tell_names(node: Node, names: Iterable[str]) -> None:
    """Tell the full names of topics, after all remapping; each brings its compressed form."""
    tell(node, NAMES, [f'{name}{form}:={node.resolve_topic_name(name)}{form}'
                       for name in names for form in FORMS.get(name, ('',))],
         'the full names of its topics, each as NAME:=TOPIC')


def full_names(parameters: Mapping[str, object]) -> dict[str, str]:
    """Return the full names that a node's parameters tell, by its own."""
    told = parameters.get(NAMES)
    entries = told if isinstance(told, list | tuple) else ()
    pairs = (str(entry).partition(':=') for entry in entries)
    return {name: full for name, given, full in pairs if given}
