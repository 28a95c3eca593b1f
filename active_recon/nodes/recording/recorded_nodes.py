"""Whose parameters a bag keeps: who is heard, and who is in the recorder's namespace."""

from collections.abc import Callable, Iterable

from active_recon.nodes.runtime.parameter_collector import AskedParameters
from active_recon.nodes.runtime.qos import endpoint_node
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo


class RecordedNodes:
    """Asks nodes for their parameters as they appear, and hands them on like AskedParameters."""

    def __init__(self, node: Node, on_known: Callable[[str, dict[str, object]], None]) -> None:
        self._node = node
        self._asked = AskedParameters(node, on_known)
        self._heard: set[str] = set()

    def __contains__(self, name: str) -> bool:
        """Return whether a node is heard, and not just there."""
        return name in self._heard

    def forget(self) -> None:
        """Ask every node anew."""
        self._asked.forget()

    def heard(self, publishers: Iterable[TopicEndpointInfo]) -> None:
        """Ask who has begun to publish once more: when it was configured it had more to tell."""
        names = set(filter(None, map(endpoint_node, publishers)))
        for name in names - self._heard:
            self._asked.forget(name)
        self._heard |= names

    def ask(self) -> None:
        """Ask those that are there now and not yet known; called again and again."""
        own = self._node.get_fully_qualified_name()
        around = {f'{namespace.rstrip("/")}/{name}'
                  for name, namespace in self._node.get_node_names_and_namespaces()}
        self._asked.ask(name for name in around - {own} if name in self._heard or (
            name.rpartition('/')[0] == own.rpartition('/')[0] and not _is_hidden(name)))

    def wait(self) -> None:
        """Ask nobody for now, and take who is there later for new."""
        self._asked.ask(())


def _is_hidden(full_name: str) -> bool:
    """Return whether ROS hides a node, as those of its command line that come and go."""
    return full_name.rpartition('/')[2].startswith('_')
