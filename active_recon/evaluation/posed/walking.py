"""Orders of views, and the network's logits after each."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import Observer
from active_recon.geometry.cameras import (
    CANONICAL_ELEVATION,
    ELEVATION_TOLERANCE,
    TURN,
    VIEW_COUNT,
)
from active_recon.geometry.view_distance import pose_directions
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_EVEN = 1e-3  # radians

Order = NDArray[np.int64]
"""Indices of c views of N objects, in order, (N, c)."""


def random_orders(objects: int, views: int, seed: int = 0) -> Order:
    """Return a random order of all V views for each of N objects, (N, V)."""
    return np.stack([np.random.default_rng([seed, item]).permutation(views)
                     for item in range(objects)])


def on_turntable(views: ViewSet) -> bool:
    """
    Return whether the views are those of the paper's networks: 24 of each object at 30 degrees.

    The elevation may differ by ELEVATION_TOLERANCE.
    """
    directions = pose_directions(views.poses.numpy())
    apart = np.abs(np.arcsin(directions[..., 2].clip(-1, 1)) - CANONICAL_ELEVATION)
    return directions.shape[1] == VIEW_COUNT and bool(
        (apart < ELEVATION_TOLERANCE + _EVEN).all())


def even_orders(directions: NDArray[np.float64], count: int, first: NDArray[np.int64]) -> Order:
    """
    Return `count` evenly spread views of each object, beginning with `first` (N,): (N, count).

    Takes unit vectors to the cameras, (N, V, 3). If an object's azimuths are V even steps, its
    views are equidistant on the circle; else each next view is the one farthest from all before.
    """
    objects, views = directions.shape[:2]
    azimuths = np.arctan2(directions[..., 1], directions[..., 0])
    steps = np.diff(azimuths, axis=1, append=azimuths[:, :1]) % TURN
    around = np.any([(np.abs(way * steps % TURN - TURN / views) < _EVEN).all(axis=1)
                     for way in (1, -1)], axis=0)
    steps_apart = np.round(np.arange(count) * views / count).astype(np.int64)
    equidistant = (first[:, None] + steps_apart) % views
    if around.all():
        return np.asarray(equidistant)
    rows, order = np.arange(objects), first[:, None]
    cosines = np.einsum('nvi,nwi->nvw', directions, directions)
    nearest = cosines[rows, first]
    for _ in range(count - 1):
        nearest[rows, order[:, -1]] = np.inf  # taken
        order = np.column_stack([order, nearest.argmin(axis=1)])
        taken = np.isinf(nearest)
        nearest = np.where(taken, np.inf, np.maximum(nearest, cosines[rows, order[:, -1]]))
    return np.where(around[:, None], equidistant, order)


@torch.inference_mode()
def walk(observer: Observer, objects: Tensor, orders: Sequence[Order],
         yaws: Tensor | None = None) -> Iterator[Tensor]:
    """
    Yield the logits (B, R, R, R) of objects (B,) after the views (B, c) of each order.

    If an order begins with the one before, the state is continued. The cameras are rotated by
    `yaws` (B,), radians.
    """
    done: Order = np.empty((len(objects), 0), np.int64)
    state = observer.initial_state(len(objects))
    for order in orders:
        if order.shape[1] < done.shape[1] or (order[:, :done.shape[1]] != done).any():
            done = done[:, :0]
            state = observer.initial_state(len(objects))
        for view in order.T[done.shape[1]:]:
            state = observer.update(objects, torch.from_numpy(view), state, yaws)
        done = order
        yield observer.decode(state)


def some_objects(views: ViewSet, rows: Tensor) -> ViewSet:
    """Return the objects (B,) of a set as a set of their own."""
    return replace(
        views, images=views.images[rows], poses=views.poses[rows],
        intrinsics=views.intrinsics[rows], voxels=views.voxels[rows],
        folders=tuple(views.folders[row] for row in rows.tolist()),
        seen=None if views.seen is None else views.seen[rows],
        depths=None if views.depths is None else views.depths[rows])
