"""
What cameras have in sight of volumes of probabilities, sampled along lines of sight.

The rule is that of `policies.candidate_rendering`: cell i of a line is in sight with
T_i = prod_(j < i) (1 - p_j), and is what the line hits with T_i p_i. Here a line is sampled at
even steps instead of cut at each cell's border, which takes less time.
"""

from dataclasses import dataclass
from functools import lru_cache
import math

import numpy as np
from numpy.typing import NDArray

RADIUS = math.sqrt(3) / 2
"""Of the sphere around the unit cube, sides of the grid."""
_WIDEST = 2.0  # tangent of half the field of view of a camera that stands near the cube
_UPRIGHT = 1e-3  # sine of the angle to the vertical below which a camera's own axes count

Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Frames:
    """
    N cameras that are aimed at the grid's centre, upright, each (N, 3) but `distance` (N,).

    - origin, and the unit vectors forward, right and down, in the object's frame
    - spread: (N,), tangent of half the angle under which the sphere around the cube is seen
    """

    origin: Array
    forward: Array
    right: Array
    down: Array
    distance: Array
    spread: Array


def upright_frames(poses: NDArray[np.floating]) -> Frames:
    """
    Return the frames of cameras at poses (N, 4, 4), whatever their roll and aim.

    A camera that stands straight above or below the centre keeps its own roll.
    """
    origin = poses[:, :3, 3].astype(np.float64)
    distance = np.linalg.norm(origin, axis=1)
    forward = -origin / distance[:, None]
    level = np.stack([forward[:, 1], -forward[:, 0], np.zeros_like(distance)], axis=1)
    own = poses[:, :3, 0].astype(np.float64)
    own = own - (own * forward).sum(axis=1, keepdims=True) * forward
    right = np.where(np.linalg.norm(level, axis=1, keepdims=True) > _UPRIGHT, level, own)
    right = right / np.linalg.norm(right, axis=1, keepdims=True)
    widest = np.sqrt(np.maximum(distance ** 2 - RADIUS ** 2, (RADIUS / _WIDEST) ** 2))
    return Frames(*(part.astype(np.float32) for part in (
        origin, forward, right, np.cross(forward, right), distance, RADIUS / widest)))


def sampled_cells(frames: Frames, side: int, rays: int, steps: int) -> NDArray[np.int32]:
    """
    Return the cells at the samples of cameras' lines of sight, (N, steps, rays, rays).

    They are places in the flat grid of side x side x side cells, nearest first, and side ** 3
    outside it. The samples of a line lie evenly within the sphere around the grid.
    """
    across = step_depths(rays) * frames.spread[:, None]
    towards = (frames.forward[:, None, None]
               + across[:, None, :, None] * frames.right[:, None, None]
               + across[:, :, None, None] * frames.down[:, None, None])
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    along = np.maximum(frames.distance[:, None] + step_depths(steps) * np.float32(RADIUS), 0)
    place = np.zeros((len(along), steps, rays, rays), np.int32)
    inside = np.ones(place.shape, np.bool_)
    for axis in range(3):
        scaled = towards[..., axis] * np.float32(side)
        # A side more keeps them above 0, where a cast rounds down
        start = (frames.origin[:, axis] + np.float32(1.5)) * np.float32(side)
        where = along[:, :, None, None] * scaled[:, None]
        where += start[:, None, None, None]
        cell = where.astype(np.int32)
        cell -= side
        inside &= cell.view(np.uint32) < side
        place *= side
        place += cell
    place[~inside] = side ** 3
    return place


def step_depths(steps: int) -> Array:
    """Return the middles of even steps from -1 (near) to 1 (far), (steps,)."""
    return ((np.arange(steps, dtype=np.float32) + np.float32(0.5)) / np.float32(steps)
            * np.float32(2) - np.float32(1))


def cells_in_sight(pose: NDArray[np.floating], occupancy: Array, rays: int,
                   steps: int) -> Array:
    """
    Return how likely each cell of (S, S, S) was in sight of a camera, (S ** 3,) in [0, 1].

    The camera (4, 4) has rays x rays lines of sight of so many steps. What counts is what lies a
    step or more before a cell: a cell does not hide itself.
    """
    samples, seen_at = _own_samples(
        np.ascontiguousarray(pose, np.float32).tobytes(), len(occupancy), rays, steps)
    free = np.append(1 - occupancy.ravel(), np.float32(1))[samples]  # (steps, lines)
    passing = np.ones_like(free)
    for step in range(1, steps):  # NumPy's cumprod takes several times as long
        np.multiply(passing[step - 1], free[step - 1], out=passing[step])
    return passing.ravel()[seen_at]


@lru_cache(maxsize=64)
def _own_samples(pose: bytes, side: int, rays: int,
                 steps: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """
    Return a camera's samples, and at which of them it sees each cell; kept from plan to plan.

    Those are cells (steps, rays ** 2), and places (side ** 3,) among them.
    """
    frames = upright_frames(np.frombuffer(pose, np.float32).reshape(1, 4, 4))
    samples = sampled_cells(frames, side, rays, steps).reshape(steps, -1)
    along = (np.arange(side, dtype=np.float32) + np.float32(0.5)) / side - np.float32(0.5)
    centers = np.stack(np.meshgrid(along, along, along, indexing='ij'), -1).reshape(-1, 3)
    away = centers - frames.origin[0]
    depth = np.maximum(away @ frames.forward[0], np.float32(1e-6))
    column, row = (((away @ axis[0]) / depth / frames.spread[0] + 1) / 2 * rays
                   for axis in (frames.right, frames.down))
    step = ((np.linalg.norm(away, axis=-1) - frames.distance[0]) / RADIUS + 1) / 2 * steps
    column, row = (each.clip(0, rays - 1).astype(np.int32) for each in (column, row))
    seen_at = (step.clip(0, steps - 1).astype(np.int32) * rays + row) * rays + column
    return samples.astype(np.intp), seen_at.astype(np.intp)
