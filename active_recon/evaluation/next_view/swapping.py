"""Another object in the place of one: what a policy that looks must lose by."""

from dataclasses import replace
import math

from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.geometry.cameras import pose_azimuths
from active_recon.geometry.view_distance import direction_distance, pose_directions
import numpy as np

_ALIKE = math.radians(0.1)


def swapped_row(row: int, count: int) -> int:
    """
    Return the object shown instead of one, half of all objects further on.

    The objects of a set are in the order of their categories: the next one would be of the same.
    """
    return (row + count // 2) % count


def require_same_cameras(views: ViewSet) -> None:
    """Raise DataError unless the cameras stand alike around all objects of a set."""
    directions = pose_directions(views.poses.numpy())  # (N, V, 3)
    if direction_distance(directions, directions[:1]).max() > _ALIKE:
        raise DataError('no other object can be shown: expected cameras that stand alike around '
                        'all objects, as `--cameras turntable` and `--cameras dome` make, got '
                        'others; leave swapped out')


def turned(views: ViewSet, rng: np.random.Generator) -> ViewSet:
    """
    Return the views of a set's one object, turned about the vertical while the cameras stay.

    The objects of a set all face the same way, which tells a policy much and a robot nothing. The
    angle is drawn from those between cameras, so that each sees what another one saw. Raises
    DataError where the cameras are no grid of azimuths.
    """
    poses = views.poses[0].numpy()
    directions = pose_directions(poses)
    azimuths = pose_azimuths(poses)
    yaw = float(azimuths[rng.integers(len(azimuths))] - azimuths[0])
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0],
                     [0, 0, 1]])
    away = direction_distance((directions @ turn)[:, None], directions)  # (V, V)
    seen = away.argmin(axis=1)
    if away.min(axis=1).max() > _ALIKE:
        raise DataError('the object cannot be turned: expected a grid of azimuths, as `--cameras '
                        'turntable` and `--cameras dome` make, got other cameras')
    return replace(views, images=views.images[:, seen], intrinsics=views.intrinsics[:, seen],
                   seen=None if views.seen is None else views.seen[:, seen],
                   depths=None if views.depths is None else views.depths[:, seen])
