"""Finds the loop to observe on the ROS graph, and reads its parameters."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
import time

from active_recon.geometry.cameras import OBJECT_FRAME
from active_recon.nodes.runtime.parameter_collector import ParameterCollector
from active_recon.nodes.runtime.qos import endpoint_node
from active_recon.nodes.runtime.topic_names import full_names
from rclpy.node import Node, NodeNameNonExistentError

_HEADER = 'std_msgs/msg/Header'
_LOOP_TOPICS = ('/episode', '/done')  # published by reconstructor and planner only
_NAMES = ('reconstructor', 'view_planner')
SILENT_S = 5.0
"""A node without parameter services for so long is none: DDS may list nodes that were killed."""


@dataclass(frozen=True)
class Loop:
    """
    A loop as its nodes' parameters describe it; what is not known has its default.

    `object_size` is in metres, a guess unless the loop `has_size`; `names` are the full names of
    topics, by the nodes' own names.
    """

    namespace: str
    object_size: float = 1.0
    object_frame: str = OBJECT_FRAME
    names: Mapping[str, str] = field(default_factory=dict)
    has_size: bool = True

    def full_name(self, name: str) -> str:
        """Return the full name of a topic or a service."""
        if name.startswith('/'):
            return name
        return self.names.get(name, f'{self.namespace.rstrip("/")}/{name}')


class LoopFinder:
    """
    Finds the nodes of one loop and requests their parameters.

    It is the loop in the node's own namespace, else the only one in any; where there are several,
    `others` are their namespaces. `on_loop` is called with the loop when it is found, and again
    when more of its parameters are known.
    """

    def __init__(self, node: Node, on_loop: Callable[[Loop], None]) -> None:
        self._node = node
        self._on_loop = on_loop
        self._collector = ParameterCollector(node, self._take)
        self._parameters_of: dict[str, dict[str, object]] = {}
        self._served_at: dict[str, float] = {}
        self._publishers: set[bytes] = set()
        self.others: tuple[str, ...] = ()

    def update(self) -> None:
        """Request the parameters of newly found nodes; to be called repeatedly."""
        nodes = {name for name in set(self._nodes()) if not self._is_silent(name)}
        spaces = sorted({_namespace(name) for name in nodes})
        own = self._node.get_namespace()
        chosen = own if own in spaces else spaces[0] if len(spaces) == 1 else None
        self.others = () if chosen else tuple(spaces)
        self._collector.request(name for name in nodes if _namespace(name) == chosen)

    def _nodes(self) -> Iterator[str]:
        """Yield the full names of nodes that belong to a loop."""
        for name in self._node.get_fully_qualified_node_names():
            if name.rpartition('/')[2] in _NAMES:
                yield name
        for topic, kinds in self._node.get_topic_names_and_types():
            if topic.endswith(_LOOP_TOPICS) and _HEADER in kinds:
                for each in self._node.get_publishers_info_by_topic(topic):
                    if node := endpoint_node(each):
                        if (gid := bytes(each.endpoint_gid)) not in self._publishers:
                            self._publishers.add(gid)
                            self._collector.forget(node)  # configured, or started again, since
                        yield node

    def _is_silent(self, name: str) -> bool:
        """Return whether a node has been without parameter services for too long."""
        now = time.monotonic()
        space, _, own = name.rpartition('/')
        try:
            services = self._node.get_service_names_and_types_by_node(own, space or '/')
        except NodeNameNonExistentError:
            services = []
        if any(service == f'{name}/list_parameters' for service, _ in services):
            self._served_at[name] = now
        return now - self._served_at.setdefault(name, now) > SILENT_S

    def _take(self, name: str, parameters: dict[str, object]) -> None:
        self._parameters_of[name] = parameters
        namespace = _namespace(name)
        known = [each for node, each in sorted(self._parameters_of.items())
                 if _namespace(node) == namespace]
        names = {own: full for each in known for own, full in full_names(each).items()}
        size, frame = (next((each[key] for each in known if key in each), None)
                       for key in ('object_size', 'object_frame'))
        self._on_loop(Loop(
            namespace, float(size) if isinstance(size, int | float) else 1.0,
            frame if isinstance(frame, str) else OBJECT_FRAME, names))


def _namespace(full_name: str) -> str:
    return full_name.rpartition('/')[0] or '/'
