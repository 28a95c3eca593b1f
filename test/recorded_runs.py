"""Runs of the loop on the core alone: what a recorder would have seen, and nothing is recorded."""

from pathlib import Path

from active_recon.bags.run import RecordedEpisode, RecordedGoal, RecordedRun, RecordedView
from active_recon.cameras import orbit_camera, wrap_azimuth
from active_recon.models.runtime import TorchRuntime
from active_recon.planner import Planner
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import RandomPolicy
from active_recon.reconstructor import Reconstructor
from active_recon.voxels import grid_from_points
import numpy as np

THRESHOLD, FLOOR = 0.15, 0.02
SECOND = 1_000_000_000


def image_at(azimuth):
    """Return an image that differs from those of other azimuths."""
    return np.random.default_rng(round(azimuth * 1e6)).integers(0, 256, (137, 137, 3), np.uint8)


def goal_of(goal, stamp):
    return RecordedGoal(wrap_azimuth(goal.azimuth), stamp, goal.candidates, goal.scores, stamp)


def episode_of(reconstructor, planner, begin, azimuth):
    """Run the loop on the core alone and return what a recorder would have seen of it."""
    reconstructor.reset()
    planner.reset()
    first = goal = planner.first_goal(azimuth)
    views, stamp, done = [], begin, ''
    while not done:
        stamp += SECOND
        camera = orbit_camera(goal.azimuth)
        image = image_at(goal.azimuth)
        known = reconstructor.add_view(image, camera)
        heard, occupied = (grid_from_points(known.grid.points(above)) for above in (
            FLOOR, THRESHOLD))
        decision = planner.add_view(known.latent, camera.azimuth, heard.entropy())
        goal, done = decision.goal, decision.reason
        views.append(RecordedView(
            stamp, image, camera, heard, occupied, known.latent, known.grid.entropy(),
            None if goal is None else goal_of(goal, stamp + 1), {}))
    return RecordedEpisode(f'from {begin}', begin, goal_of(first, begin), views, done)


def loop_of(network, policy):
    return (Reconstructor(TorchRuntime(network), THRESHOLD), Planner(policy, 3, 0.0))


def policies(attention):
    return {'attention': lambda: AttentionPolicy(attention),
            'random': lambda: RandomPolicy(np.random.default_rng(7))}


def run_of(episodes):
    return RecordedRun(Path('run'), episodes, {}, {}, {}, [], SECOND, 10 * SECOND)
