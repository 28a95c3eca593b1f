"""The loop that a watcher follows: found on the graph, its size, frame and names asked for."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from active_recon.geometry.cameras import OBJECT_FRAME
from active_recon.nodes.runtime.parameter_collector import AskedParameters
from active_recon.nodes.runtime.qos import endpoint_node
from active_recon.nodes.runtime.topic_names import full_names
from rclpy.node import Node

_HEADER = 'std_msgs/msg/Header'
_TOLD_BY = ('/episode', '/done')  # what reconstructor and planner publish, and nobody else
_NAMES = ('reconstructor', 'view_planner')


@dataclass(frozen=True)
class Loop:
    """
    What the nodes of a loop say of it: what is not known, or not yet, is as it is by default.

    `object_size` is in metres; `names` are full names of topics, by those in the nodes.
    """

    namespace: str
    object_size: float = 1.0
    object_frame: str = OBJECT_FRAME
    names: Mapping[str, str] = field(default_factory=dict)

    def full_name(self, name: str) -> str:
        """Return what a topic or a service is called outside of the nodes."""
        if name.startswith('/'):
            return name
        return self.names.get(name, f'{self.namespace.rstrip("/")}/{name}')


class LoopFinder:
    """
    Looks for the nodes of one loop and asks them for their parameters.

    That is the one in the node's own namespace, else the only one in any; `others` are the
    namespaces where there are several to choose from. Each that is known, and all that it then
    tells anew, is handed to `on_known`.
    """

    def __init__(self, node: Node, on_known: Callable[[Loop], None]) -> None:
        self._node = node
        self._on_known = on_known
        self._asked = AskedParameters(node, self._take)
        self._told: dict[str, dict[str, object]] = {}
        self.others: tuple[str, ...] = ()

    def look(self) -> None:
        """Ask those that are there by now; called again and again."""
        nodes = set(self._nodes())
        spaces = sorted({_namespace(name) for name in nodes})
        own = self._node.get_namespace()
        chosen = own if own in spaces else spaces[0] if len(spaces) == 1 else None
        self.others = () if chosen else tuple(spaces)
        self._asked.ask(name for name in nodes if _namespace(name) == chosen)

    def _nodes(self) -> Iterator[str]:
        """Yield the full names of nodes that are those of a loop."""
        for name, namespace in self._node.get_node_names_and_namespaces():
            if name in _NAMES:
                yield f'{namespace.rstrip("/")}/{name}'
        for topic, kinds in self._node.get_topic_names_and_types():
            if topic.endswith(_TOLD_BY) and _HEADER in kinds:
                publishers = self._node.get_publishers_info_by_topic(topic)
                yield from filter(None, map(endpoint_node, publishers))

    def _take(self, name: str, parameters: dict[str, object]) -> None:
        self._told[name] = parameters
        namespace = _namespace(name)
        told = [each for node, each in sorted(self._told.items()) if _namespace(node) == namespace]
        names = {own: full for each in told for own, full in full_names(each).items()}
        size, frame = (next((each[key] for each in told if key in each), None)
                       for key in ('object_size', 'object_frame'))
        self._on_known(Loop(
            namespace, float(size) if isinstance(size, int | float) else 1.0,
            frame if isinstance(frame, str) else OBJECT_FRAME, names))


def _namespace(full_name: str) -> str:
    return full_name.rpartition('/')[0] or '/'
