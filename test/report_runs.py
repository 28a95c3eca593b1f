"""Runs as a bag would give them, made by the core without any bag: what a report is tested on."""

from dataclasses import replace
from pathlib import Path

from active_recon.bags.runs.run import (
    RecordedEpisode,
    RecordedGoal,
    RecordedRun,
    RecordedView,
    TopicSummary,
)
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.weights_files import find_weights, PAPER_MODEL
from active_recon.objects import find_object
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor
from active_recon.simulation.shown_object import rendered_object
from active_recon.volumes.voxels import VoxelGrid
import numpy as np

BEGIN = 1_790_000_000_000_000_000
MS = 1_000_000
WAY, NETWORK, HAND_OVER, DECISION, TURN = 2 * MS, 8 * MS, 1 * MS, 4 * MS, 1500 * MS
ARRIVALS = {'camera/image_raw': WAY, 'occupancy': WAY + NETWORK, 'latent': WAY + NETWORK,
            'view': WAY + NETWORK + HAND_OVER // 2, 'probabilities': WAY + NETWORK + HAND_OVER,
            'entropy': WAY + NETWORK + HAND_OVER}


def recorded_run(name='chair', policy='uniform', views=5, start=0.5):
    """Return a run of one episode, as the loop would have made it, with round times."""
    weights = find_weights(PAPER_MODEL if policy == 'attention' else None)
    shown = rendered_object(find_object(name))
    # One thread: others give other last bits
    reconstructor = Reconstructor.load(weights, threads=1)
    planner = Planner.load(policy, weights, max_views=views, entropy_tolerance=0, threads=1)
    goal = first = _recorded(planner.first_goal(orbit_camera(start)), BEGIN + 50 * MS)
    taken = []
    while goal is not None:
        stamp = goal.received + TURN
        image, camera = shown.seen_from(goal.camera.azimuth)
        known = reconstructor.add_view(image, camera)
        entropy = known.grid.entropy()
        decision = planner.add_view(known.latent, camera, entropy)
        goal = decision.goal and _recorded(
            decision.goal, stamp + WAY + NETWORK + HAND_OVER + DECISION)
        occupancy = known.grid.occupancy
        taken.append(RecordedView(
            stamp, image, camera,
            VoxelGrid(np.where(occupancy > 0.02, occupancy, 0)),
            VoxelGrid(np.where(occupancy > reconstructor.threshold, occupancy, 0)),
            known.latent, entropy, goal,
            {role: stamp + after for role, after in ARRIVALS.items()}))
    return RecordedRun(
        Path(f'bags/2026-09-21_14-13-20_{name}_{policy}'),
        [RecordedEpisode('5c3f09ab12de', BEGIN, first, taken, decision.reason)],
        {'version': '0.1.0', **reconstructor.provenance, 'policy': policy,
         'seed': '0', 'object': f'{name}.glb'},
        {'reconstructor': {'goal_tolerance': 0.14, 'object_size': 1.0, 'object_yaw': 0.0},
         'turntable_camera': {'mesh': str(find_object(name)), 'up': '', 'front': ''},
         'view_planner': {'policy': policy, 'max_views': views}},
        {'/reconstructor': {'episodes': 1, 'images': 80, 'images_unused': 75, 'views': views}},
        [TopicSummary('/camera/image_raw', 'sensor_msgs/msg/Image', 80),
         TopicSummary('/occupancy', 'sensor_msgs/msg/PointCloud2', views)],
        BEGIN, taken[-1].stamp + 500 * MS)


def changed(run, **changes):
    """Return the run with other fields in its episode."""
    return replace(run, episodes=[replace(run.episodes[0], **changes)])


def _recorded(goal, received):
    return RecordedGoal.of(goal, received - MS, received)
