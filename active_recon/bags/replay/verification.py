"""Verification that a run replays to what was recorded."""

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
    The result of a replay: its episodes, the comparison and the hash of all that was computed.

    `knows_policy`: whether the bag names the policy, so that its decisions were replayed.
    """

    episodes: Sequence[ReplayedEpisode]
    comparison: Comparison
    hash: str
    knows_policy: bool

    @property
    def view_count(self) -> int:
        """The number of views in all episodes."""
        return sum(len(episode.steps) for episode in self.episodes)


def verify(run: RecordedRun, reconstructor: Reconstructor, planner: Planner | None,
           advance: Callable[[], None] = lambda: None) -> Verification:
    """
    Replay a run and compare it with the recording; `advance` is called after each view.

    Raises ViewError on an invalid view.
    """
    episodes = replay(run, reconstructor, planner, advance)
    return Verification(episodes, compare(episodes, reconstructor.threshold),
                        replay_hash(episodes), planner is not None)
