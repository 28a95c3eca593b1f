"""Augmentation of posed views: backgrounds, tables, light, noise, cropped images, pose errors."""

from collections.abc import Mapping

from active_recon.datasets.views import ViewSet, with_seen
from active_recon.models.network import Cameras
from active_recon.training import augmentation
from active_recon.training.tables import draw_tables
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor
from torch.nn import functional

SHARES = {'white': 0.16, 'plain': 0.12, 'gradient': 0.08, 'noise': 0.1, 'clutter': 0.14,
          'pieces': 0.12, 'tiles': 0.1, 'black': 0.11, 'dark': 0.07}
"""The fraction of the sequences that have each kind of background."""
MOST_TURN, MOST_SHIFT = np.radians(1.0), 0.01
"""The largest pose errors: radians, and a fraction of the distance."""
_CUT_SHARE, _MOST_CUT = 0.12, 0.4  # of the views, and of a view's side
TABLE_SHARE = 0.3
"""The fraction of the sequences whose object stands on a table."""
_NOISE, _DARKEST, _BRIGHTEST = 0.03, 0.6, 2.2


def augment_posed(images: Tensor, seen: Tensor, cameras: Cameras, voxels: Tensor, views: ViewSet,
                  rng: np.random.Generator, shares: Mapping[str, float] = SHARES,
                  table_share: float = TABLE_SHARE) -> Tensor:
    """
    Return augmented images (T, B, 4, S, S) in [0, 1] of premultiplied ones (T, B, S, S, 4) uint8.

    Some objects, of voxels (B, R, R, R), stand on a table. The fourth channel is 1 where the
    image has the pixel: `seen` (T, B, S, S) bool, less what is cropped from some views. `shares`
    are those of the kinds of backgrounds, `table_share` that of tables. `rng` is the only source
    of randomness.
    """
    length, size, side = images.shape[:3]
    planes = images.permute(0, 1, 4, 2, 3).float().div_(255)
    planes[:, :, :3] = augmentation.jitter_colors(planes, rng)
    kinds = augmentation.draw_kinds(shares, size, rng)
    behind = augmentation.draw_backgrounds(kinds, BACKGROUNDS, views, length, rng)
    on_table = torch.from_numpy(np.flatnonzero(rng.random(size) < table_share))
    if len(on_table):
        table = draw_tables(Cameras(cameras.poses[:, on_table], cameras.intrinsics[:, on_table]),
                            voxels[on_table], side, rng)
        behind[:, on_table] = behind[:, on_table] * (1 - table[:, :, 3:]) + table[:, :, :3]
    # Shadows are deepened or lifted on the object alone, so that black stays black
    gamma = _tensor(np.exp(rng.uniform(np.log(_DARKEST), np.log(_BRIGHTEST), (size, 1, 1, 1))))
    alpha = planes[:, :, 3:]
    color = (planes[:, :, :3] / alpha.clamp(min=1e-3)).clamp_(1e-4, 1).pow(gamma) * alpha
    pictures = behind.mul_(1 - alpha).add_(color)
    away = torch.from_numpy(np.flatnonzero(kinds != 'white'))
    pictures[:, away] *= augmentation.light(len(away), side, rng)
    pictures = _blurred(pictures, rng)
    level = _tensor(rng.uniform(0, _NOISE, (size, 1, 1, 1)) * (rng.random((size, 1, 1, 1)) < 0.5))
    grain = rng.standard_normal((length, size, 1, side, side), np.float32)
    pictures.add_(torch.from_numpy(grain) * level)
    return with_seen(pictures.clamp_(0, 1), seen & _uncut(length, size, side, rng))


def perturb_poses(cameras: Cameras, rng: np.random.Generator) -> Cameras:
    """Return cameras (T, B, ...) with small pose errors in half of the sequences."""
    shape = cameras.poses.shape[:2]
    off = np.where(rng.random(shape[1]) < 0.5, 1.0, 0.0)[None, :, None]
    angles = rng.uniform(-1, 1, (*shape, 3)) / np.sqrt(3) * MOST_TURN * off
    x, y, z = np.moveaxis(angles, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1),
                     np.stack([-y, x, zero], -1)], -2)
    turn = torch.linalg.matrix_exp(torch.from_numpy(skew))
    poses = cameras.poses.clone()
    poses[..., :3, :3] = poses[..., :3, :3] @ turn
    distance = poses[..., :3, 3].norm(dim=-1, keepdim=True)
    moved = torch.from_numpy(rng.uniform(-1, 1, (*shape, 3)) / np.sqrt(3) * MOST_SHIFT * off)
    poses[..., :3, 3] += moved * distance
    return Cameras(poses, cameras.intrinsics)


def _blurred(pictures: Tensor, rng: np.random.Generator) -> Tensor:
    """Return pictures (T, B, 3, S, S), some of them out of focus."""
    chosen = torch.from_numpy(np.flatnonzero(rng.random(pictures.shape[1]) < 0.25))
    if len(chosen):
        flat = pictures[:, chosen].flatten(0, 1)
        pictures[:, chosen] = functional.avg_pool2d(
            functional.pad(flat, (1, 1, 1, 1), mode='replicate'), 3, 1).reshape(
                len(pictures), len(chosen), *flat.shape[1:])
    return pictures


def _uncut(length: int, size: int, side: int, rng: np.random.Generator) -> Tensor:
    """Return what is left of images of which some end earlier at one side, (T, B, S, S) bool."""
    share = rng.uniform(0, _MOST_CUT, (length, size)) * (rng.random((length, size)) < _CUT_SHARE)
    kept = (torch.arange(side) + 0.5) / side > _tensor(share)[..., None]  # (T, B, S)
    edge = torch.from_numpy(rng.integers(4, size=(length, size)))
    kept = torch.where((edge % 2 == 0)[..., None], kept, kept.flip(-1))
    rows, columns = kept[..., None], kept[..., None, :]
    return torch.where((edge < 2)[..., None, None], rows, columns).expand(-1, -1, side, side)


def _black(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return black, (count, 3, 1, 1)."""
    return torch.zeros(count, 3, 1, 1)


def _dark(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return noise in the dark, (T, count, 3, S, S)."""
    return augmentation.BACKGROUNDS['noise'](views, length, count, rng) * _tensor(
        rng.uniform(0.02, 0.3, (count, 1, 1, 1)))


def _tiles(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return tiles of any size, turn and colour, (T, count, 3, S, S)."""
    rows = torch.from_numpy(rng.integers(3, 25, count))
    colors = torch.from_numpy(rng.random((length, count, 3, 24, 24), np.float32))
    grey = colors.mean(dim=2, keepdim=True)
    colors = torch.lerp(grey, colors, _tensor(rng.random((count, 1, 1, 1))))
    angle = _tensor(rng.uniform(0, np.pi, (count, 1, 1)))
    along = torch.arange(views.image_size) / views.image_size - 0.5
    across, down = (along * part + along[:, None] * other for part, other in (
        (angle.cos(), angle.sin()), (-angle.sin(), angle.cos())))  # (count, S, S)
    column, row = ((part * rows[:, None, None]).floor().long() % 24 for part in (across, down))
    return colors[:, torch.arange(count)[:, None, None], :, row, column].permute(
        3, 0, 4, 1, 2)


def _tensor(numbers: NDArray[np.float64]) -> Tensor:
    return torch.from_numpy(numbers.astype(np.float32))


BACKGROUNDS: dict[str, augmentation.Background] = {
    **augmentation.BACKGROUNDS, 'black': _black, 'dark': _dark, 'tiles': _tiles}
"""See `augmentation.BACKGROUNDS`."""
