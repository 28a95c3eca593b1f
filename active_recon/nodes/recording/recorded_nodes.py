"""The nodes whose parameters a bag keeps: publishers, and those in the recorder's namespace."""

from collections.abc import Callable, Iterable

from active_recon.nodes.runtime.hidden_nodes import is_hidden
from active_recon.nodes.runtime.parameter_collector import ParameterCollector
from active_recon.nodes.runtime.qos import endpoint_node
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo


class RecordedNodes:
    """Requests nodes' parameters as they appear; `on_parameters` as in ParameterCollector."""

    def __init__(self, node: Node,
                 on_parameters: Callable[[str, dict[str, object]], None]) -> None:
        self._node = node
        self._collector = ParameterCollector(node, on_parameters)
        self._publishing: dict[bytes, str] = {}  # by the publisher's GID

    def __contains__(self, name: str) -> bool:
        """Return whether a node publishes a recorded topic."""
        return name in self._publishing.values()

    def forget(self) -> None:
        """Request the parameters of every node again."""
        self._collector.forget()

    def add_publishers(self, publishers: Iterable[TopicEndpointInfo]) -> None:
        """
        Request the parameters of nodes with new publishers again.

        A node may declare more when it is configured, or may have been restarted since.
        """
        for publisher in publishers:
            gid, name = bytes(publisher.endpoint_gid), endpoint_node(publisher)
            if name is not None and gid not in self._publishing:
                self._publishing[gid] = name
                self._collector.forget(name)

    def update(self) -> None:
        """Request the parameters of nodes that are not known yet; to be called repeatedly."""
        own = self._node.get_fully_qualified_name()
        space = own.rpartition('/')[0]
        running = set(self._node.get_fully_qualified_node_names())
        self._collector.request(name for name in running - {own} if name in self or (
            name.rpartition('/')[0] == space and not is_hidden(name.removeprefix(space))))

    def pause(self) -> None:
        """Request nothing, and regard nodes that are running later as new."""
        self._collector.request(())
