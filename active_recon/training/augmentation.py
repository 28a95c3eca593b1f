"""Augmentation of rendered views: background, light, colours, shift and scale."""

from collections.abc import Callable, Mapping

from active_recon.datasets.views import on_background, ViewSet
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor
from torch.nn import functional

MOST_SHIFT = 1 / 32  # of the image's side
MOST_SCALE = 0.04
_MOSAIC_MARGIN = 1 / 4  # of an image's side: no crop of a mosaic shows an object whole
_SHAPES = 8  # painted over each other on a cluttered canvas
_LUMA = torch.tensor([0.299, 0.587, 0.114])

Background = Callable[[ViewSet, int, int, np.random.Generator], Tensor]
"""Draws T views of n sequences' backgrounds; see `BACKGROUNDS`."""


def augment(images: Tensor, intrinsics: Tensor, views: ViewSet,
         rng: np.random.Generator) -> tuple[Tensor, Tensor]:
    """
    Return augmented images (T, B, 3, S, S) in [0, 1], and their intrinsics (T, B, 3, 3).

    Takes premultiplied images (T, B, S, S, 4) uint8 and their intrinsics. Half of the sequences
    keep a white background. The others, in the proportions of `SHARES`, get another background,
    a small shift and scale in each view, and uneven light. The colours of every object are
    jittered. `rng` is the only source of randomness.
    """
    length, size, side = images.shape[:3]
    planes = images.permute(0, 1, 4, 2, 3).float().div_(255)
    planes[:, :, :3] = jitter_colors(planes, rng)
    kinds = draw_kinds(SHARES, size, rng)
    away = torch.from_numpy(np.flatnonzero(kinds != 'white'))
    if len(away):
        shown = planes[:, away]
        shifted, motion = shift_and_scale(shown.flatten(0, 1), rng)
        planes[:, away] = shifted.view_as(shown)
        intrinsics = intrinsics.clone()
        intrinsics[:, away] = motion.reshape(length, -1, 3, 3) @ intrinsics[:, away]
    behind = draw_backgrounds(kinds, BACKGROUNDS, views, length, rng)
    pictures = behind.mul_(1 - planes[:, :, 3:]).add_(planes[:, :, :3])
    pictures[:, away] *= light(len(away), side, rng)
    return pictures.clamp_(0, 1), intrinsics


def draw_kinds(shares: Mapping[str, float], size: int,
               rng: np.random.Generator) -> NDArray[np.str_]:
    """Return the background's kind of each of `size` sequences, (size,)."""
    return rng.choice(list(shares), size, p=list(shares.values()))


def draw_backgrounds(kinds: NDArray[np.str_], backgrounds: Mapping[str, Background],
                      views: ViewSet, length: int, rng: np.random.Generator) -> Tensor:
    """Return T = `length` views of a background of each of kinds (B,), (T, B, 3, S, S)."""
    side = views.image_size
    behind = torch.ones(length, len(kinds), 3, side, side)  # white, but for what is drawn
    for kind, draw in backgrounds.items():
        rows = torch.from_numpy(np.flatnonzero(kinds == kind))
        if len(rows):
            behind[:, rows] = draw(views, length, len(rows), rng).expand(
                length, -1, -1, side, side)
    return behind


def shift_and_scale(planes: Tensor, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
    """
    Return premultiplied planes (N, 4, S, S), each shifted and scaled about its middle.

    The shift is at most 1/32 of the side along each axis, the scale at most 4 %. Alpha moves with
    the colours, and what comes in at the border is empty. The second value, (N, 3, 3) float64,
    maps old pixels to new ones: new intrinsics are this matrix times the old ones.
    """
    side = planes.shape[-1]
    scale = 1 / rng.uniform(1 - MOST_SCALE, 1 + MOST_SCALE, len(planes))
    shift = rng.uniform(-1, 1, (len(planes), 2)) * MOST_SHIFT * 2  # half a side counts 1
    to_source = np.zeros((len(planes), 2, 3), np.float32)
    to_source[:, [0, 1], [0, 1]] = scale[:, None]
    to_source[:, :, 2] = -shift * scale[:, None]
    grid = functional.affine_grid(torch.from_numpy(to_source), list(planes.shape),
                                  align_corners=False)
    motion = np.zeros((len(planes), 3, 3))
    motion[:, [0, 1], [0, 1]] = 1 / scale[:, None]
    motion[:, :2, 2] = (1 - 1 / scale[:, None] + shift) * side / 2
    motion[:, 2, 2] = 1
    return functional.grid_sample(planes, grid, align_corners=False), torch.from_numpy(motion)


def jitter_colors(planes: Tensor, rng: np.random.Generator) -> Tensor:
    """Return the colours of planes (T, B, 4, S, S) under one gain and saturation per sequence."""
    size = planes.shape[1]
    gains = rng.uniform(0.75, 1.25, (size, 1)) * rng.uniform(0.85, 1.15, (size, 3))
    saturation = _tensor(rng.uniform(0.5, 1.4, (size, 1, 1)))
    grey = _LUMA.expand(3, 3)
    matrices = _tensor(gains)[:, :, None] * (saturation * torch.eye(3) + (1 - saturation) * grey)
    colors = torch.matmul(matrices, planes[:, :, :3].flatten(-2))
    return torch.minimum(colors.clamp_(min=0).view_as(planes[:, :, :3]), planes[:, :, 3:])


def light(count: int, side: int, rng: np.random.Generator) -> Tensor:
    """Return a coloured light that falls off across the image, (count, 3, S, S) about 1."""
    across = _across(side)
    gains = _tensor(rng.uniform(0.8, 1.2, (count, 3, 1, 1)))
    slopes = _tensor(rng.uniform(-0.2, 0.2, (2, count, 1, 1, 1)))
    return gains * (1 + slopes[0] * across + slopes[1] * across[:, None])


# The backgrounds of n sequences of T views: what gives (n, ...) is the same in all views


def _plain(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return plain colours, (count, 3, 1, 1)."""
    return _colors(rng, count)


def _gradient(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return one colour that becomes another along a line, (count, 3, S, S)."""
    angle = _tensor(rng.uniform(0, 2 * np.pi, (count, 1, 1, 1)))
    across = _across(views.image_size)
    along = angle.cos() * across + angle.sin() * across[:, None]
    share = (along / 2 ** 0.5 + 1) / 2
    return torch.lerp(_colors(rng, count), _colors(rng, count), share)


def _noise(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return coarse, middling and fine noise in random shares, (T, count, 3, S, S)."""
    whole = views.image_size
    weights = _tensor(rng.dirichlet([1, 1, 1], count).T)[..., None, None, None]
    total = torch.zeros(())
    for weight, side in zip(weights, (4, 16, whole), strict=True):
        cells = torch.from_numpy(rng.random((length * count, 3, side, side), np.float32))
        smooth = functional.interpolate(cells, size=(whole, whole), mode='bilinear')
        total = total + weight * smooth.reshape(length, count, 3, whole, whole)
    saturation = _tensor(rng.random((count, 1, 1, 1)))
    return torch.lerp(total.mean(dim=2, keepdim=True), total, saturation)


def _clutter(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return crops of a canvas painted with boxes and ellipses, (T, count, 3, S, S)."""
    side = views.image_size + views.image_size // 2
    across = torch.linspace(-1, 1, side)
    canvas = _colors(rng, count).repeat(1, 1, side, side)
    for _ in range(_SHAPES):
        x, y = _tensor(rng.uniform(-1, 1, (2, count, 1, 1)))
        angle = _tensor(rng.uniform(0, np.pi, (count, 1, 1)))
        half_sides = _tensor(rng.uniform(0.05, 0.6, (2, count, 1, 1)))
        right, down = across - x, across[:, None] - y
        u = (angle.cos() * right + angle.sin() * down) / half_sides[0]
        v = (angle.cos() * down - angle.sin() * right) / half_sides[1]
        box = torch.from_numpy(rng.random((count, 1, 1)) < 0.5)
        inside = torch.where(box, torch.maximum(u.abs(), v.abs()), u * u + v * v) < 1
        canvas = torch.where(inside[:, None], _colors(rng, count), canvas)
    return _crops(canvas, length, views.image_size, 0, rng)


def _pieces(views: ViewSet, length: int, count: int, rng: np.random.Generator) -> Tensor:
    """Return crops across the seams of four other images of the set, (T, count, 3, S, S)."""
    whole = views.image_size
    objects, chosen = (torch.from_numpy(rng.integers(most, size=count * 4))
                       for most in views.images.shape[:2])
    colors = _colors(rng, count).flatten(1).repeat_interleave(4, dim=0)
    tiles = on_background(views.images[objects, chosen], colors)
    square = tiles.reshape(count, 2, 2, 3, whole, whole).permute(0, 3, 1, 4, 2, 5)
    mosaic = square.reshape(count, 3, 2 * whole, 2 * whole)
    return _crops(mosaic, length, whole, round(_MOSAIC_MARGIN * whole), rng)


def _crops(canvases: Tensor, length: int, size: int, margin: int,
           rng: np.random.Generator) -> Tensor:
    """Return a crop of S x S pixels of each canvas (n, 3, C, C) for each view, (T, n, 3, S, S)."""
    count, _, side, _ = canvases.shape
    corners = rng.integers(margin, side - size - margin + 1, (2, length, count))
    windows = canvases.unfold(2, size, 1).unfold(3, size, 1)  # a view, no copy
    top, left = torch.from_numpy(corners)
    return windows[torch.arange(count), :, top, left]


def _colors(rng: np.random.Generator, count: int) -> Tensor:
    """Return colours of any saturation, (count, 3, 1, 1): most of the world is rather grey."""
    grey, saturation = rng.random((2, count, 1, 1, 1))
    return _tensor(grey + saturation * (rng.random((count, 3, 1, 1)) - grey))


def _across(side: int) -> Tensor:
    """Return the pixels' centres in [-1, 1], (S,)."""
    return (torch.arange(side) + 0.5) / side * 2 - 1


def _tensor(numbers: NDArray[np.float64]) -> Tensor:
    return torch.from_numpy(numbers.astype(np.float32))


BACKGROUNDS: dict[str, Background] = {
    'plain': _plain, 'gradient': _gradient, 'noise': _noise, 'clutter': _clutter,
    'pieces': _pieces}
"""
What draws a background for T views of n sequences, `(views, T, n, rng)`: colours in [0, 1] that
expand to (T, n, 3, S, S).
"""
SHARES = {'white': 0.5, 'plain': 0.15, 'gradient': 0.08, 'noise': 0.07, 'clutter': 0.1,
          'pieces': 0.1}
"""The fraction of the sequences that have each kind of background."""
