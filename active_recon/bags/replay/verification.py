"""Whether a run replays to what was recorded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.bags.replay.comparison import compare, Comparison
from active_recon.bags.replay.replay import replay, replay_hash, ReplayedEpisode
from active_recon.bags.runs.run import RecordedRun
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor


@dataclass(frozen=True)
class Verification:
    """
    What came of a replay: its episodes, the comparison, the hash of every bit computed.

    `knows_policy`: whether the bag tells which policy chose, so that it was asked again.
    """

    episodes: Sequence[ReplayedEpisode]
    comparison: Comparison
    hash: str
    knows_policy: bool

    @property
    def view_count(self) -> int:
        """Of all episodes."""
        return sum(len(episode.views) for episode in self.episodes)


def verify(run: RecordedRun, reconstructor: Reconstructor, planner: Planner | None,
           advance: Callable[[], None] = lambda: None) -> Verification:
    """
    Replay a run with what it was made with, and compare; `advance` is called after each view.

    Raises ViewError on a view that is none.
    """
    episodes = replay(run, reconstructor, planner, advance)
    return Verification(episodes, compare(episodes, reconstructor.threshold),
                        replay_hash(episodes), planner is not None)
