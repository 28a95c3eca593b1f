"""Replay: recorded views through the core again, without ROS and without a clock."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import hashlib

from active_recon.acquisition.goals import Goal
from active_recon.bags.runs.recorded_object import replay_views
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun, RecordedView
from active_recon.geometry.cameras import Camera
from active_recon.planner import Decision, Planner
from active_recon.quality.quality import Quality
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.voxels import entropy, PUBLISHED_FLOOR
import numpy as np


@dataclass(frozen=True, eq=False)
class ReplayStep:
    """One view reconstructed again; the decision after it is None without a planner."""

    recorded: RecordedView
    reconstruction: Reconstruction
    decision: Decision | None


@dataclass(frozen=True, eq=False)
class ReplayedEpisode:
    """An episode replayed; the first goal follows from the first camera pose."""

    recorded: RecordedEpisode
    first_goal: Goal | None
    steps: Sequence[ReplayStep]


def replay(run: RecordedRun, reconstructor: Reconstructor, planner: Planner | None = None,
           advance: Callable[[], None] = lambda: None) -> list[ReplayedEpisode]:
    """
    Reconstruct with all views again, in the order of their stamps, and decide after each.

    The planner continues from episode to episode as the node's did, so that a seed draws the
    same. `advance` is called after each view. Raises ViewError on an invalid view.
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
    steps = []
    for step in replay_views(episode.views, reconstructor):
        decision = None
        if planner is not None:
            # A loop whose bag has no quality decided without it
            quality = None if step.view.quality is None else step.known.quality
            decision = decide(planner, step.known, step.view.camera, quality)
            _give_up(planner, episode.given_up(step.view))
        steps.append(ReplayStep(step.view, step.known, decision))
        advance()
    return ReplayedEpisode(episode, first_goal, steps)


def _give_up(planner: Planner, goals: Sequence[Camera]) -> None:
    """Give up the goals that the run gave up: a replay has no clock for their timeouts."""
    for goal in goals:
        planner.give_up(goal)


def decide(planner: Planner, reconstruction: Reconstruction, camera: Camera,
           quality: Quality | None) -> Decision:
    """Return the planner's decision from what its node receives."""
    grid = reconstruction.grid
    return planner.add_view(reconstruction.latent, camera, grid.entropy(),
                            grid.above(PUBLISHED_FLOOR) if planner.wants_volume else None, quality)


def replay_hash(episodes: Sequence[ReplayedEpisode]) -> str:
    """Return the SHA-256 of all occupancies, latents, entropies and decisions of a replay."""
    digest = hashlib.sha256()
    for step in (step for episode in episodes for step in episode.steps):
        reconstruction, decision = step.reconstruction, step.decision
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
