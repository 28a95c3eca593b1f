"""Runs of the loop on the core alone: what a recorder would have seen, and nothing is recorded."""

from dataclasses import replace
from pathlib import Path

from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedRun, RecordedView
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.planner import Decision, Planner
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import RandomPolicy
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes.torch import TorchPolicyRuntime, TorchRuntime
from active_recon.volumes.point_grids import grid_from_points
import numpy as np

THRESHOLD, FLOOR = 0.15, 0.02
SECOND = 1_000_000_000


def image_at(azimuth):
    """Return an image that differs from those of other azimuths."""
    return np.random.default_rng(round(azimuth * 1e6)).integers(0, 256, (137, 137, 3), np.uint8)


def goal_of(goal, stamp):
    return RecordedGoal.of(goal, stamp)


def episode_of(reconstructor, planner, begin, start, given_up=()):
    """
    Run the loop on the core alone and return what a recorder would have seen of it.

    It begins where a camera stands, or a canonical one at an azimuth.

    `given_up`: how many goals are given up before the first view, after it, after the second, ...
    """
    def asked_for(decision, stamp):
        """Return the goal that is followed at last, what was asked for, and why there is none."""
        if decision.goal is None:
            return None, None, decision.reason
        goals = [goal_of(decision.goal, stamp)]
        for _ in range(next(failing, 0)):
            decision = planner.give_up(decision.goal.camera)
            if decision.goal is None:
                break
            goals.append(goal_of(decision.goal, stamp + len(goals)))
        return decision.goal, replace(goals[0], replacements=goals[1:]), decision.reason

    failing = iter(given_up)
    start = start if isinstance(start, Camera) else orbit_camera(start)
    reconstructor.reset()
    planner.reset()
    goal, first, done = asked_for(Decision(planner.first_goal(start)), begin)
    views, stamp = [], begin
    while not done:
        stamp += SECOND
        camera = goal.camera
        image = image_at(camera.azimuth)
        known = reconstructor.add_view(image, camera)
        heard, occupied = (grid_from_points(known.grid.points(above)) for above in (
            FLOOR, THRESHOLD))
        decision = planner.add_view(known.latent, camera, heard.entropy())
        goal, asked, done = asked_for(decision, stamp + 1)
        views.append(RecordedView(
            stamp, image, camera, heard, occupied, known.latent, known.grid.entropy(),
            asked, {}))
    return RecordedEpisode(f'from {begin}', begin, first, views, done)


def loop_of(network, policy, views=3, **motion):
    reconstructor = Reconstructor(TorchRuntime(network, THRESHOLD))
    return reconstructor, Planner(policy, views, 0.0, **motion)


def policies(attention):
    return {'attention': lambda: AttentionPolicy(TorchPolicyRuntime(attention)),
            'random': lambda: RandomPolicy(np.random.default_rng(7))}


def run_of(episodes):
    return RecordedRun(Path('run'), episodes, {}, {}, {}, [], SECOND, 10 * SECOND)
