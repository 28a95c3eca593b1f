"""What is seen of a loop in a soak: its episodes, its latency, what its nodes complain of."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import time

from active_recon.launching.loop_client import joined_domain, LoopClient
from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_from_msg
from msg_tools.episodes import done_from_msg, Episode, episode_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

# On a busy machine two views may wait here at once, and none shall take the other's place.
_ALL = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_FAULTS = ('refused/', 'warned/', 'dropped/')


class SoakMonitor(LoopClient):
    """
    Counts episodes, the views of each (`views`), and what the nodes complained of (`faults`).

    What came before `begin`, while the nodes were starting, does not count.
    """

    def __init__(self, node: Node, executor: SingleThreadedExecutor,
                 check: Callable[[], None]) -> None:
        super().__init__(node, executor)
        self.views: list[int] = []
        self._check = check
        self._episode: Episode | None = None
        self._ids: set[str] = set()
        self._stamps: set[int] = set()
        self._last_stamp: int | None = None
        self._latencies: list[float] = []
        self._at_first: dict[str, Counter[str]] = {}
        self._counted: dict[str, Counter[str]] = {}
        node.create_subscription(PointCloud2, 'occupancy', self._on_occupancy, _ALL)
        node.create_subscription(Header, 'episode', self._on_episode, _ALL)
        node.create_subscription(Header, 'done', self._on_done, _ALL)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)

    @property
    def faults(self) -> Counter[str]:
        """Refusals, warnings and losses since the beginning, by node and kind."""
        return Counter({f'{node} {kind}': count for node, counts in self._counted.items()
                        for kind, count in (counts - self._at_first.get(node, Counter())).items()})

    def begin(self) -> None:
        """Count from now on."""
        self.views.clear()
        self._latencies.clear()
        self._at_first = dict(self._counted)

    def latency_ms(self, percent: float) -> float:
        """Return a percentile of the time from an image's stamp to its occupancy heard here."""
        return float(np.percentile(self._latencies or [np.nan], percent))

    def wait_done(self, budget_s: float) -> None:
        """Wait for the end of the episode, and for the view that it ended with."""
        self.until(lambda: self._last_stamp in self._stamps, budget_s, 'the end of an episode',
                   self._check)
        assert self._episode is not None
        self.views.append(sum(stamp > self._episode.begin for stamp in self._stamps))
        self._stamps.clear()

    def call(self, service: str, budget_s: float) -> str:
        """Call a Trigger service, as `trigger` does, while the nodes live."""
        return self.trigger(service, budget_s, self._check)

    def _on_occupancy(self, msg: PointCloud2) -> None:
        stamp = nanoseconds_from_stamp(msg.header.stamp)
        self._stamps.add(stamp)
        self._latencies.append((time.time_ns() - stamp) / 1e6)

    def _on_episode(self, msg: Header) -> None:
        episode = episode_from_msg(msg)
        if episode.id in self._ids:
            raise AssertionError(f'expected a new id for each episode, got {episode.id} again')
        self._ids.add(episode.id)
        self._episode, self._last_stamp = episode, None

    def _on_done(self, msg: Header) -> None:
        stamp, reason = done_from_msg(msg)
        if reason and self._episode is not None and stamp > self._episode.begin:
            self._last_stamp = stamp

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for name, status in diagnostics_from_msg(msg).items():
            self._counted[name] = Counter({kind: count for kind, count in status.counts.items()
                                           if kind.startswith(_FAULTS)})


@contextmanager
def soak_monitor(check: Callable[[], None]) -> Iterator[SoakMonitor]:
    """Join the domain that the environment names; `check` raises where a node has died."""
    with joined_domain('soak') as (node, executor):
        yield SoakMonitor(node, executor, check)
