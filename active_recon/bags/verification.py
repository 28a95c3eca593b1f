"""Whether a run replays to what was recorded."""

from collections.abc import Callable
from dataclasses import dataclass

from active_recon.bags.comparison import compare, Comparison
from active_recon.bags.replay import replay, replay_hash
from active_recon.bags.run import RecordedRun
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor


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


def verify(run: RecordedRun, reconstructor: Reconstructor, planner: Planner | None,
           advance: Callable[[], None] = lambda: None) -> Verification:
    """
    Replay a run with what it was made with, and compare; `advance` is called after each view.

    Raises ViewError on a view that is none.
    """
    episodes = replay(run, reconstructor, planner, advance)
    return Verification(
        compare(episodes, reconstructor.threshold), replay_hash(episodes),
        sum(len(episode.views) for episode in episodes), planner is not None)
