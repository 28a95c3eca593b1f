"""Where the next photo of a shape should be taken from, and whether there are enough."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.acquisition.goals import Goal
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.geometry.view_distance import view_distance
from active_recon.models.weights_files import DEFAULT_MODEL, find_weights
from active_recon.photos.shape import Shape
from active_recon.planner import Planner
from active_recon.policies import AUTO_POLICY, load_policy, PolicyOptions
from active_recon.policies.reasons import GoalReason
from active_recon.policies.stopping import StoppingRule
from active_recon.quality.tables import tables_path
import numpy as np
from numpy.typing import NDArray

ELEVATIONS = (math.radians(20), math.radians(60))
"""Between which photos are asked for, radians: from lower, a board can hardly be read."""
_AROUND = math.radians(25)  # who cannot stand somewhere cannot stand right beside it
ENOUGH: Mapping[str, str] = {
    'target_reached': 'the quality that was asked for is promised',
    'max_views': 'there are as many photos as were planned',
    'target_out_of_reach': 'further photos will not bring the quality that was asked for',
    'entropy_settled': 'the last photos hardly changed the shape',
    'gain_too_small': 'no further photo is expected to gain much',
    'no_reachable_azimuth': 'there is no place left'}
"""Why there are photos enough, by the planner's reason."""


@dataclass(frozen=True, eq=False)
class Advice:
    """
    The best next view, though there may be enough.

    - goal: in the object frame, metres; None where no place is left; why: what it would show
    - done: why there are photos enough, a key of ENOUGH; '' while there are not
    """

    goal: Goal | None
    why: GoalReason | None
    done: str = ''


class Adviser:
    """
    Plans the next photo by the view policy of a model's weights, or by an even sweep.

    Raises ConfigError on a target quality for weights without tables, which promise none.
    """

    def __init__(self, stopping: StoppingRule, model: str | Path = DEFAULT_MODEL,
                 threads: int | None = 1) -> None:
        weights = find_weights(model)
        tables = tables_path(weights)
        if stopping.target_quality and not tables.is_file():
            raise ConfigError(f'target_quality: never promised: expected quality tables beside '
                              f'the weights, {tables.name}, found none; leave the target out')
        self._stopping = stopping
        self._policy = load_policy(AUTO_POLICY, PolicyOptions(
            views=stopping.max_views, weights=weights, threads=threads))

    def advice(self, shape: Shape, skipped: Sequence[NDArray[np.float64]] = ()) -> Advice:
        """
        Return the advice after all photos of a shape.

        Candidates stand on a dome as far away as the photos were, by their median. Those around
        the places `skipped`, (3,) each in the world of the photos' cameras, are left out.
        """
        rule = self._stopping
        planner = Planner(
            self._policy, rule.max_views, rule.entropy_tolerance,
            distance=float(np.median([view.camera.distance for view in shape.views])),
            elevation_range=ELEVATIONS, target_quality=rule.target_quality,
            min_gain=rule.min_gain)
        done = ''
        for view in shape.views:
            known = view.known
            done = planner.add_view(known.latent, view.camera, known.grid.entropy(), known.grid,
                                    known.quality).reason
        for camera in (_camera_at(place, shape) for place in skipped):
            goal = planner.next_goal().goal
            for each in [] if goal is None else goal.candidates:
                if view_distance(each, camera) < _AROUND:
                    done = planner.give_up(each).reason or done
        return Advice(planner.next_goal().goal, planner.reason(), done)


def _camera_at(place: NDArray[np.float64], shape: Shape) -> Camera:
    """Return a camera at a place of the photos' world, in the object frame."""
    x, y, z, _ = np.linalg.inv(shape.world_from_object) @ (*place, 1.0)
    return orbit_camera(math.atan2(y, x), math.atan2(z, math.hypot(x, y)), math.hypot(x, y, z))
