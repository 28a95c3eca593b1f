"""Which topics are recorded: those that are named, wherever the loop's nodes say they are."""

from collections.abc import Iterable, Iterator, Mapping

from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.topic_names import FORMS
from active_recon.parameters.recorder import TOPICS
from rclpy.node import Node

NEEDED = ('camera/image_raw', 'camera/camera_info', 'camera/pose')
"""Of the default topics, those without which a recording cannot be replayed."""
_LOOKS = 50  # without a publisher, before that is told


class RecordedTopics:
    """
    The full names of the topics, which may grow as nodes tell the names they have for them.

    In the diagnostics what nobody publishes is the trouble `no_publisher`: of the default topics
    only what every loop has, of others all.
    """

    def __init__(self, node: Node, names: tuple[str, ...], diagnostics: Diagnostics) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._full = {name: {node.resolve_topic_name(name)} for name in names}
        self._needed = NEEDED if names == TOPICS else names
        self.begin()

    def begin(self) -> None:
        """Await publishers anew."""
        self._looks = 0
        self._published: set[str] = set()

    def __iter__(self) -> Iterator[str]:
        """Yield full names."""
        return iter(sorted(set().union(*self._full.values())))

    def named(self, name: str) -> set[str]:
        """Return the full names that a topic has; none where it is not recorded."""
        return self._full.get(name, set())

    def learn(self, told: Mapping[str, str]) -> dict[str, str]:
        """
        Take in what a node of the loop tells of its topics: the full names by its own.

        Returns those that are recorded and that were remapped.
        """
        learnt = {}
        for name, full in told.items():
            if name in self._full:
                self._full[name].add(full)
                if full != f'{self._node.get_namespace().rstrip("/")}/{name.lstrip("/")}':
                    learnt[name] = full
        return learnt

    def look(self, published: Iterable[str]) -> None:
        """Be told again and again which of the topics have publishers."""
        self._looks += 1
        self._published.update(published)
        silent = [name for name in self._needed if not any(
            self.named(f'{name}{form}') & self._published for form in FORMS.get(name, ('',)))]
        if silent and self._looks > _LOOKS:
            topics = sorted(full for name in silent for full in self.named(name))
            self._diagnostics.begin_trouble('no_publisher', (
                f'expected publishers on {", ".join(topics)}, none was there yet, so nothing of '
                'them is recorded; remap with -r NAME:=TOPIC where they have other names'))
        else:
            self._diagnostics.end_trouble('no_publisher')
