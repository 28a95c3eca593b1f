"""Views shown to a network by tests: canonical cameras, and what is known after some views."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from active_recon.datasets.views import ViewSet
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from torch import Tensor


class Known(NamedTuple):
    """Occupancy logits (B, R, R, R), the latent, and the whole state."""

    logits: Tensor
    latent: Tensor
    state: State


def cameras_at(azimuths: Sequence[float] | Tensor, size: int = 64) -> Cameras:
    """Return canonical cameras at azimuths, radians, whose images have `size` pixels a side."""
    lens = CANONICAL_INTRINSICS.resized(size, size)
    return Cameras.of([orbit_camera(float(azimuth), intrinsics=lens) for azimuth in azimuths])


def known_after(network: ReconstructionNetwork, images: Tensor,
                azimuths: Sequence[float] | None = None) -> Known:
    """Return what is known after views (T, B, 3, S, S), each of them from an azimuth."""
    batch = images.shape[1]
    state = network.initial_state(batch)
    for t, view in enumerate(images):
        at = 0.5 * t if azimuths is None else azimuths[t]
        state = network.step(view, cameras_at([at] * batch, view.shape[-1]), state)
    return Known(network.decode(state), state['latent'], state)


def part_of(views: ViewSet, objects: slice = slice(None), chosen: slice = slice(None)) -> ViewSet:
    """Return some of the objects of a set, with some of their views."""
    return replace(views, images=views.images[objects, chosen],
                   poses=views.poses[objects, chosen],
                   intrinsics=views.intrinsics[objects, chosen], voxels=views.voxels[objects],
                   folders=views.folders[objects],
                   seen=None if views.seen is None else views.seen[objects, chosen])
