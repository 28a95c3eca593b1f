"""A table that the object stands on, with a texture and the object's shadow, seen by each view."""

from collections.abc import Sequence

from active_recon.models.network import Cameras
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor
from torch.nn import functional

_REACH = 1.5  # half the side of the shadow's map, in sides of the grid
_SHADOW_SIDE, _SOLID_SIDE, _TEXTURE_SIDE = 96, 32, 64
_SPOTTED = 0.15  # share of the tables
_NARROWEST, _WIDEST = 0.6, 4.0  # half sides of tables, in sides of the grid


def draw_tables(cameras: Cameras, voxels: Tensor, side: int, rng: np.random.Generator) -> Tensor:
    """
    Return what cameras (T, B, ...) see of B tables, (T, B, 4, S, S) premultiplied, in [0, 1].

    A table is the horizontal plane under the lowest occupied cell of voxels (B, R, R, R), a
    square of random size and texture; from below nothing of it is seen. The object's shadow falls
    on it from one light, the same for all views of an object.
    """
    solid = functional.max_pool3d(voxels[:, None], voxels.shape[-1] // _SOLID_SIDE)[:, 0]
    count = len(solid)
    bottom = solid.amax(dim=(1, 2)).argmax(dim=1) / _SOLID_SIDE - 0.5  # (B,)
    ground, in_front = _on_the_plane(cameras, bottom, side)  # (T, B, S, S, 2)
    turn = _tensor(rng.uniform(0, 2 * np.pi, (count, 1, 1)))
    u = turn.cos() * ground[..., 0] + turn.sin() * ground[..., 1]
    v = turn.cos() * ground[..., 1] - turn.sin() * ground[..., 0]
    half = _tensor(np.exp(rng.uniform(np.log(_NARROWEST), np.log(_WIDEST), (2, count, 1, 1))))
    inside = (in_front & (u.abs() < half[0]) & (v.abs() < half[1])).float()
    texture = _looked_up(_textures(count, rng), torch.stack([u, v], -1) / _WIDEST)
    shadow = _looked_up(_shadows(solid, bottom, rng), ground / _REACH)
    return torch.cat([texture * (1 - shadow), torch.ones_like(shadow)], 2) * inside[:, :, None]


def _on_the_plane(cameras: Cameras, bottom: Tensor, side: int) -> tuple[Tensor, Tensor]:
    """Return where pixels see planes z = bottom (B,), (T, B, S, S, 2), and whether they do."""
    poses, lenses = cameras.poses.float(), cameras.intrinsics.float()
    along = torch.arange(side) + 0.5
    pixels = torch.stack([along.expand(side, side), along[:, None].expand(side, side),
                          torch.ones(side, side)])
    rays = poses[..., :3, :3] @ torch.linalg.inv(lenses) @ pixels.flatten(1)  # (T, B, 3, S * S)
    position = poses[..., :3, 3]
    below = bottom - position[..., 2]  # (T, B)
    distance = below[..., None] / rays[..., 2, :].clamp(max=-1e-3)
    ground = position[..., :2, None] + distance[..., None, :] * rays[..., :2, :]
    in_front = (rays[..., 2, :] < -1e-3) & (below < 0)[..., None]
    shape = (*ground.shape[:2], side, side)
    return ground.transpose(-1, -2).reshape(*shape, 2), in_front.reshape(shape)


def _looked_up(maps: Tensor, where: Tensor) -> Tensor:
    """Return maps (B, C, h, w) at (T, B, S, S, 2), 0 outside [-1, 1], (T, B, C, S, S)."""
    length, count, side = where.shape[:3]
    rows = where.transpose(0, 1).reshape(count, length * side, side, 2)
    found = functional.grid_sample(maps, rows, align_corners=False)
    return found.reshape(count, -1, length, side, side).permute(2, 0, 1, 3, 4)


def _textures(count: int, rng: np.random.Generator) -> Tensor:
    """
    Return textures of tables, (B, 3, h, w).

    They are plain, grained, checked or of boards in two colours, or have spots of all colours.
    """
    fine = _TEXTURE_SIDE
    grain = _tensor(rng.random((count, 1, fine, fine)))
    coarse = _drawn(rng, [1, fine // 8, fine // 8], count)
    cells = torch.arange(fine) // 2
    checks = ((cells + cells[:, None]) % 2).float().expand(count, 1, fine, fine)
    boards = torch.cat([_drawn(rng, [1, *rng.integers((2, 24), (8, fine + 1))])
                        for _ in range(count)])
    kinds = torch.stack([coarse, grain, checks, 0.5 * (grain + coarse), boards])
    share = kinds[torch.from_numpy(rng.integers(len(kinds), size=count)), torch.arange(count)]
    grey = rng.uniform(0.05, 1, (2, count, 1, 1, 1))
    hue = grey + rng.random((2, count, 1, 1, 1)) ** 2 * (rng.random((2, count, 3, 1, 1)) - grey)
    first, second = _tensor(hue)
    two = torch.lerp(first, second, share * _tensor(rng.random((count, 1, 1, 1))))
    spots = torch.cat([_drawn(rng, [3, *rng.integers(6, fine + 1, 2)]) for _ in range(count)])
    return torch.where(torch.from_numpy(rng.random((count, 1, 1, 1)) < _SPOTTED), spots, two)


def _drawn(rng: np.random.Generator, shape: Sequence[int], count: int = 1) -> Tensor:
    """Return random patterns in [0, 1] of so many channels and cells, (B, C, h, w)."""
    side = _TEXTURE_SIDE
    return functional.interpolate(_tensor(rng.random((count, *shape))), size=(side, side),
                                  mode='bilinear')


def _shadows(solid: Tensor, bottom: Tensor, rng: np.random.Generator) -> Tensor:
    """Return the share of light that objects (B, R, R, R) take from their tables, (B, 1, h, w)."""
    count, side = len(solid), solid.shape[-1]
    height, azimuth = np.radians(rng.uniform(30, 80, count)), rng.uniform(0, 2 * np.pi, count)
    lean = _tensor(np.stack([np.cos(azimuth), np.sin(azimuth)], 1) / np.tan(height)[:, None])
    along = ((torch.arange(_SHADOW_SIDE) + 0.5) / _SHADOW_SIDE * 2 - 1) * _REACH
    places = torch.stack([along.expand(_SHADOW_SIDE, _SHADOW_SIDE),
                          along[:, None].expand(_SHADOW_SIDE, _SHADOW_SIDE)], -1)
    shadow = torch.zeros(count, 1, _SHADOW_SIDE, _SHADOW_SIDE)
    for level in range(side):
        above = (level + 0.5) / side - 0.5 - bottom  # (B,)
        toward = places + (above[:, None] * lean)[:, None, None]
        # Slices are indexed [x, y]; what looks them up counts x along the last axis
        slices = solid[:, :, :, level].transpose(1, 2)[:, None]
        found = functional.grid_sample(slices, 2 * toward, align_corners=False)
        shadow = torch.maximum(shadow, found * (above > 0)[:, None, None, None])
    soft = functional.avg_pool2d(shadow, 5, 1, 2)
    return soft * _tensor(rng.uniform(0.15, 0.85, (count, 1, 1, 1)))


def _tensor(numbers: NDArray[np.float64]) -> Tensor:
    return torch.from_numpy(numbers.astype(np.float32))
