"""Whether a run replays to what was recorded."""

from collections.abc import Callable
from dataclasses import dataclass

from active_recon.bags.comparison import compare, Comparison
from active_recon.bags.replay import fixed_arithmetic, replay, replay_hash
from active_recon.bags.run import RecordedRun
from active_recon.bags.settings import Settings


@dataclass(frozen=True)
class Verification:
    """
    What came of a replay: the comparison, and the hash of every bit that was computed.

    `knows_policy`: whether the bag tells which policy chose, so that it was asked again.
    """

    comparison: Comparison
    hash: str
    view_count: int
    knows_policy: bool


def verify(run: RecordedRun, settings: Settings, threads: int | None = None,
           advance: Callable[[], None] = lambda: None) -> Verification:
    """
    Replay a run as it was recorded and compare.

    `threads` of the network; None: as many as the run had. Raises WeightsError and ConfigError
    where what it was made with cannot be loaded, ViewError on a view that is none.
    """
    reconstructor, planner = settings.load_reconstructor(), settings.load_planner()
    with fixed_arithmetic(threads or settings.threads):
        episodes = replay(run, reconstructor, planner, advance)
    return Verification(
        compare(episodes, reconstructor.threshold), replay_hash(episodes),
        sum(len(episode.views) for episode in episodes), planner is not None)
