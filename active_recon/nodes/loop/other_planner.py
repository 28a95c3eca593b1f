"""Warns while another node publishes goals, too, so that two of them steer one camera."""

import time

from active_recon.nodes.runtime.diagnostics import Diagnostics, FORGOTTEN_S
from rclpy.node import Node

_WARNING = 'other_planner'
_UNKNOWN = '_NODE_NAME_UNKNOWN_'  # of a node that was heard of only just now


class OtherPlanner:
    """
    Looks for other publishers of `next_view`; one of the node's own name is `same_name`.

    It waits as long as DDS may list a node that was killed.
    """

    def __init__(self, node: Node, diagnostics: Diagnostics) -> None:
        self._node, self._diagnostics = node, diagnostics
        self._topic = node.resolve_topic_name('next_view')
        self._alone_at = time.monotonic()

    def tell(self) -> None:
        """Warn if there is another; to be called repeatedly."""
        found = {f'{each.node_namespace.rstrip("/")}/{each.node_name}'
                 for each in self._node.get_publishers_info_by_topic(self._topic)
                 if each.node_name != _UNKNOWN}
        others = sorted(found - {self._node.get_fully_qualified_name()})
        if not others:
            self._alone_at = time.monotonic()
            self.clear()
        elif time.monotonic() - self._alone_at > FORGOTTEN_S:
            self._diagnostics.raise_warning(_WARNING, (
                f'{self._topic}: {", ".join(others)} publishes goals, too: expected one planner, '
                'since the camera follows each of them in turn; stop the other, or start it in a '
                'namespace'))

    def clear(self) -> None:
        """Clear the warning, as when the planner no longer publishes goals itself."""
        self._diagnostics.clear_warning(_WARNING)
