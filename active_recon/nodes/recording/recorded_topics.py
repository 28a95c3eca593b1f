"""The topics to record, with the full names that the loop's nodes have for them."""

from collections.abc import Iterable, Iterator, Mapping

from active_recon.errors import ConfigError
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.topic_names import TRANSPORT_SUFFIXES
from active_recon.parameters.recorder import TOPICS
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

NEEDED = ('camera/image_raw', 'camera/camera_info', 'camera/pose')
"""The default topics without which a recording cannot be replayed."""
_CHECKS = 50  # without a publisher, before the warning


class RecordedTopics:
    """
    The full names of the recorded topics; nodes may add the names they have for them.

    In the diagnostics, topics without a publisher are the warning `no_publisher`: of the default
    topics only those that every loop has, else all. ConfigError on what can be no topic's name.
    """

    def __init__(self, node: Node, names: tuple[str, ...], diagnostics: Diagnostics) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._full = {name: {_full_name(node, name)} for name in names}
        self._needed = NEEDED if names == TOPICS else names
        self.begin()

    def begin(self) -> None:
        """Expect publishers again."""
        self._checks = 0
        self._published: set[str] = set()

    def __iter__(self) -> Iterator[str]:
        """Yield full names."""
        return iter(sorted(set().union(*self._full.values())))

    def named(self, name: str) -> set[str]:
        """Return the full names that a topic has; none where it is not recorded."""
        return self._full.get(name, set())

    def add_names(self, names: Mapping[str, str]) -> dict[str, str]:
        """
        Add the full names that a node of the loop has for its topics, by its own names.

        Returns those that are recorded and remapped.
        """
        remapped = {}
        for name, full in names.items():
            if name in self._full:
                self._full[name].add(full)
                if full != f'{self._node.get_namespace().rstrip("/")}/{name.lstrip("/")}':
                    remapped[name] = full
        return remapped

    def update(self, published: Iterable[str]) -> None:
        """Note which of the topics have publishers; to be called repeatedly."""
        self._checks += 1
        self._published.update(published)
        silent = [name for name in self._needed if not any(
            self.named(f'{name}{suffix}') & self._published
            for suffix in TRANSPORT_SUFFIXES.get(name, ('',)))]
        if silent and self._checks > _CHECKS:
            topics = sorted(full for name in silent for full in self.named(name))
            self._diagnostics.raise_warning('no_publisher', (
                f'no publishers on {", ".join(topics)}: expected one on each, so nothing of '
                'them is recorded; remap with -r NAME:=TOPIC where they have other names'))
        else:
            self._diagnostics.clear_warning('no_publisher')


def _full_name(node: Node, name: str) -> str:
    try:
        return node.resolve_topic_name(name)
    except rclpy_implementation.RCLError as error:
        reason = str(error).partition(', at ')[0]  # without the line of the C code
        raise ConfigError('parameter topics: invalid value: expected names that topics can have, '
                          f'got {name!r}: {reason}') from error
