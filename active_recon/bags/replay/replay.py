"""Replay: the recorded views through the core again, with no ROS and no clock."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import hashlib

from active_recon.bags.runs.recorded_object import seen_again
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun, RecordedView
from active_recon.geometry.cameras import Camera
from active_recon.planner import Decision, Goal, Planner
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.voxels import entropy, PUBLISHED_FLOOR
import numpy as np


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
    first_goal = None
    if planner is not None:
        planner.reset()
        if episode.first_goal is not None:
            first_goal = planner.first_goal(episode.first_goal.camera)
            _give_up(planner, episode.given_up(None))
    views = []
    for step in seen_again(episode.views, reconstructor):
        decision = None
        if planner is not None:
            decision = decide(planner, step.known, step.view.camera)
            _give_up(planner, episode.given_up(step.view))
        views.append(ReplayedView(step.view, step.known, decision))
        advance()
    return ReplayedEpisode(episode, first_goal, views)


def _give_up(planner: Planner, goals: Sequence[Camera]) -> None:
    """Leave out what the run left out: no clock tells again when a goal took too long."""
    for goal in goals:
        planner.give_up(goal)


def decide(planner: Planner, reconstruction: Reconstruction, camera: Camera) -> Decision:
    """Return what the planner decides of what its node hears."""
    grid = reconstruction.grid
    return planner.add_view(reconstruction.latent, camera, grid.entropy(),
                            grid.above(PUBLISHED_FLOOR) if planner.wants_volume else None)


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
                digest.update(repr(decision.goal.camera.azimuth).encode())
                digest.update(decision.goal.scores.tobytes())
    return digest.hexdigest()
