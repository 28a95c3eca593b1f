"""Replay: the recorded views through the core again, with no ROS and no clock."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import hashlib

from active_recon.bags.run import RecordedEpisode, RecordedRun, RecordedView
from active_recon.planner import Decision, Goal, Planner
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.voxels import entropy
import numpy as np
import torch


@dataclass(frozen=True, eq=False)
class ReplayedView:
    """A view folded in again; the decision after it is None where no planner was asked."""

    recorded: RecordedView
    reconstruction: Reconstruction
    decision: Decision | None


@dataclass(frozen=True, eq=False)
class ReplayedEpisode:
    """An episode's views again; the first goal follows from where the camera stood."""

    recorded: RecordedEpisode
    first_goal: Goal | None
    views: Sequence[ReplayedView]


def replay(run: RecordedRun, reconstructor: Reconstructor, planner: Planner | None = None,
           advance: Callable[[], None] = lambda: None) -> list[ReplayedEpisode]:
    """
    Fold all views in again, in the order of their stamps, and decide after each.

    The planner goes from episode to episode as the node's did, so that a seed draws the same.
    `advance` is called after each view. Raises ViewError on a view that is none.
    """
    return [_replay_episode(episode, reconstructor, planner, advance)
            for episode in sorted(run.episodes, key=lambda episode: episode.begin)]


def _replay_episode(episode: RecordedEpisode, reconstructor: Reconstructor,
                    planner: Planner | None, advance: Callable[[], None]) -> ReplayedEpisode:
    reconstructor.reset()
    first_goal = None
    if planner is not None:
        planner.reset()
        if episode.first_goal is not None:
            first_goal = planner.first_goal(episode.first_goal.azimuth)
            _give_up(planner, episode.given_up(None))
    views = []
    for view in sorted(episode.views, key=lambda view: view.stamp):
        reconstruction = reconstructor.add_view(view.image, view.camera)
        decision = None if planner is None else decide(
            planner, reconstruction, view.camera.azimuth)
        if planner is not None:
            _give_up(planner, episode.given_up(view))
        views.append(ReplayedView(view, reconstruction, decision))
        advance()
    return ReplayedEpisode(episode, first_goal, views)


def _give_up(planner: Planner, azimuths: Sequence[float]) -> None:
    """Leave out what the run left out: no clock tells again when a goal took too long."""
    for azimuth in azimuths:
        planner.give_up(azimuth)


def decide(planner: Planner, reconstruction: Reconstruction, azimuth: float) -> Decision:
    """Return what the planner decides of what its node hears."""
    return planner.add_view(reconstruction.latent, azimuth, reconstruction.grid.entropy())


def replay_hash(episodes: Sequence[ReplayedEpisode]) -> str:
    """Return the SHA-256 of every bit that a replay has computed."""
    digest = hashlib.sha256()
    for view in (view for episode in episodes for view in episode.views):
        reconstruction, decision = view.reconstruction, view.decision
        digest.update(reconstruction.grid.occupancy.tobytes())
        digest.update(reconstruction.latent.tobytes())
        of_all_cells = float(entropy(reconstruction.grid.occupancy.astype(np.float64)))
        digest.update(repr(of_all_cells).encode())
        if decision is not None:
            digest.update(decision.reason.encode())
            if decision.goal is not None:
                digest.update(repr(decision.goal.azimuth).encode())
                digest.update(decision.goal.scores.tobytes())
    return digest.hexdigest()


@contextmanager
def computing_with(threads: int) -> Iterator[None]:
    """
    Let torch compute with so many threads: sums that are shared out otherwise round otherwise.

    Nothing else has to be fixed. The networks' operations on a CPU all add in the same order
    every time, and torch's switch for deterministic algorithms takes seconds to import.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)
