"""Lifting: image features sampled at each cell's projection, and their statistics over views."""

from collections.abc import Mapping
from typing import Any

from active_recon.models.network import Cameras
import torch
from torch import nn, Tensor
from torch.autograd.function import FunctionCtx
from torch.nn import functional

GEOMETRY = 5
"""Channels of a view's geometry at a cell: depth beyond the centre, ray direction, scale."""
_NEAREST = 0.05  # sides of the grid in front of the camera
_MIN_VARIANCE = 0.01


def cell_centers(side: int, device: torch.device | None = None) -> Tensor:
    """Return the centres of a grid's cells, (N, 3) of a unit cube, indexed [x, y, z]."""
    along = (torch.arange(side, device=device) + 0.5) / side - 0.5
    return torch.stack(torch.meshgrid(along, along, along, indexing='ij'), -1).reshape(-1, 3)


def projection(cameras: Cameras, image_size: int) -> Tensor:
    """Return K [R t] in units in which the image spans [-1, 1], (B, 3, 4) float32."""
    poses, lenses = cameras.poses.double(), cameras.intrinsics.double()
    rotation = poses[:, :3, :3].transpose(1, 2)
    scale = torch.tensor([[2 / image_size, 0, -1], [0, 2 / image_size, -1], [0, 0, 1.0]],
                         dtype=torch.float64, device=poses.device)
    with torch.autocast(poses.device.type, enabled=False):  # half precision is too coarse
        moved = -rotation @ poses[:, :3, 3:]
        return (scale @ lenses @ torch.cat([rotation, moved], dim=2)).float()


def projected(matrices: Tensor, side: int) -> tuple[Tensor, Tensor]:
    """
    Project the N centres of a grid's cells, in [x, y, z] order, by matrices (B, 3, 4).

    Returns image points (B, N, 2), in units in which the image spans [-1, 1], and depths (B, N).
    """
    along = (torch.arange(side, device=matrices.device) + 0.5) / side - 0.5
    x, y, z = (matrices[:, :, axis, None] * along for axis in range(3))  # (B, 3, side) each
    planes = ((x + matrices[:, :, 3:])[..., None] + y[:, :, None]).flatten(2)  # (B, 3, side ** 2)
    depth = (planes[:, 2, :, None] + z[:, 2, None]).flatten(1)
    # Products of matrices put the two coordinates of a point beside each other: a transposition
    # of as many points takes longer
    one = torch.ones_like(z[:, :1])
    both = torch.tensor([[1.0, 0], [0, 1]], device=matrices.device).repeat(1, side)
    across = torch.cat([both.expand(len(z), -1, -1),
                        z[:, :2].transpose(1, 2).reshape(len(z), 1, 2 * side)], dim=1)
    behind = torch.cat([one, z[:, 2:]], dim=1).repeat_interleave(2, dim=2)
    with torch.autocast(matrices.device.type, enabled=False):  # half precision is too coarse
        found = _and_one(planes[:, :2]) @ across / (_and_one(planes[:, 2:]) @ behind).clamp(
            min=_NEAREST)
    return found.reshape(len(z), -1, 2), depth


def child_matrices(matrices: Tensor, side: int) -> Tensor:
    """
    Return matrices that project the 8 halves of each of a grid's cells instead of the cell.

    Takes (B, 3, 4) and returns (8 B, 3, 4), to be used by `projected` with the same `side`: row
    8 b + i is for half i of object b, in the order of `depth_to_space`.
    """
    along = torch.tensor([-0.25, 0.25], device=matrices.device) / side
    offsets = torch.stack(torch.meshgrid(along, along, along, indexing='ij')).reshape(3, 8)
    with torch.autocast(matrices.device.type, enabled=False):  # half precision is too coarse
        moved = (matrices[:, :, :3] @ offsets + matrices[:, :, 3:]).transpose(1, 2)  # (B, 8, 3)
    turned = matrices[:, None, :, :3].expand(-1, 8, -1, -1)
    return torch.cat([turned, moved[..., None]], dim=3).flatten(0, 1)


def _and_one(rows: Tensor) -> Tensor:
    """Return rows (B, K, N) as columns, with one more that is 1, (B, N, K + 1)."""
    return torch.cat([rows, torch.ones_like(rows[:, :1])], dim=1).transpose(1, 2)


def sampled(maps: Tensor, where: Tensor) -> Tensor:
    """Sample maps (B, C, h, w) at points (B, N, 2) in [-1, 1]: (B, C, N), outside them 0."""
    return functional.grid_sample(maps.float(), where[:, None], align_corners=False)[:, :, 0]


class Lift(nn.Module):
    """Samples a view's map at each cell's projection."""

    def __init__(self, side: int) -> None:
        super().__init__()
        self._side = side

    def centers(self, maps: Tensor) -> Tensor:
        """Return the cells' centres, (N, 3), on the maps' device."""
        return cell_centers(self._side, maps.device)

    def sample(self, maps: Tensor, seen: Tensor,
               matrices: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """
        Return features (B, C, N) of maps (B, C, h, w), their weights (B, 1, N), depths (B, N).

        The weight is 0 where a cell is behind the camera, outside its image, or where the image
        is not `seen` (B, 1, h, w); else 1.
        """
        where, depth = projected(matrices, self._side)
        features = sampled(torch.cat([maps, seen.to(maps.dtype)], dim=1), where)
        inside = (features[:, -1] > 0.5) & (depth > _NEAREST)
        return features[:, :-1], inside[:, None].float(), depth

    def forward(self, maps: Tensor, seen: Tensor, cameras: Cameras,
                matrices: Tensor) -> tuple[Tensor, Tensor]:
        """Return features (B, C, N) of maps (B, C, h, w), and their weights (B, 1, N)."""
        features, weight, _ = self.sample(maps, seen, matrices)
        return features, weight


class GeometricLift(Lift):
    """
    Samples a view's map at each cell's projection and combines it with the view's geometry.

    The sampled features are added to the geometry's `hidden` features, and the sum is mixed into
    `channels`.
    """

    def __init__(self, side: int, hidden: int, channels: int) -> None:
        super().__init__(side)
        self.geometry = nn.Sequential(
            nn.Conv1d(GEOMETRY, hidden, 1), nn.ReLU(), nn.Conv1d(hidden, hidden, 1))
        self.mix = nn.Conv1d(hidden, channels, 1)

    def forward(self, maps: Tensor, seen: Tensor, cameras: Cameras,
                matrices: Tensor) -> tuple[Tensor, Tensor]:
        """Return features (B, C, N) of maps (B, hidden, h, w), and their weights (B, 1, N)."""
        sampled_maps, weight, depth = self.sample(maps, seen, matrices)
        position = cameras.poses[:, :3, 3].float()
        rays = self.centers(maps).T - position[:, :, None]  # (B, 3, N)
        distance = position.norm(dim=1)[:, None, None]
        focal = cameras.intrinsics[:, 0, 0].float()[:, None, None] / seen.shape[-1]
        geometry = torch.cat([
            4 * (depth[:, None] - distance), rays / rays.norm(dim=1, keepdim=True),
            (focal / distance).log().expand(-1, -1, rays.shape[2])], dim=1)
        features = self.mix(functional.relu(sampled_maps + self.geometry(geometry)))
        return features.float(), weight


def initial_statistics(batch: int, channels: int, side: int,
                       device: torch.device) -> dict[str, Tensor]:
    """
    Return the view statistics before any view, zeros of (B, C, side, side, side) each.

    They are `count` (B, 1, ...), `sum`, `sum_squares`, `max` and `min` of the lifted features.
    """
    empty = torch.zeros(batch, channels, side, side, side, device=device)
    return {'count': empty[:, :1], 'sum': empty, 'sum_squares': empty, 'max': empty, 'min': empty}


def aggregate(statistics: Mapping[str, Tensor], features: Tensor,
              weight: Tensor) -> dict[str, Tensor]:
    """
    Return the view statistics with T more views.

    Takes features (T, B, C, N) and weights (T, B, 1, N) of 0 or 1. A cell that a view does not
    see counts as 0 in the maximum and the minimum.
    """
    if features.requires_grad:
        new = _Reduce.apply(features, weight)  # type: ignore[no-untyped-call]
    else:
        new = (_reduce_one if len(features) == 1 else _reduce)(features, weight)
    total, squares, highest, lowest = (part.reshape(statistics['sum'].shape) for part in new)
    return {
        'count': statistics['count'] + weight.sum(dim=0).reshape(statistics['count'].shape),
        'sum': statistics['sum'] + total,
        'sum_squares': statistics['sum_squares'] + squares,
        'max': torch.where(highest > statistics['max'], highest, statistics['max']),
        'min': torch.where(lowest < statistics['min'], lowest, statistics['min'])}


def _reduce(features: Tensor, weight: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return sum, sum of squares, maximum and minimum of (T, B, C, N) over T views."""
    new = features * weight
    return new.sum(dim=0), (new * new).sum(dim=0), new.amax(dim=0), new.amin(dim=0)


def _reduce_one(features: Tensor, weight: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return what `_reduce` returns, of one view, without passing over it for each of them."""
    new = features[0] * weight[0]
    return new, new * new, new, new


class _Reduce(torch.autograd.Function):
    """`_reduce` with a backward pass that takes half the time of autograd's."""

    @staticmethod
    def forward(ctx: FunctionCtx, features: Tensor,
                weight: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return what `_reduce` returns."""
        found = _reduce(features, weight)
        ctx.save_for_backward(features, weight, *found[2:])
        return found

    @staticmethod
    def backward(ctx: Any, total: Tensor, squares: Tensor, highest: Tensor,
                 lowest: Tensor) -> tuple[Tensor, None]:
        """Return the gradient of the features; an extreme's goes to all views that attain it."""
        features, weight, maximum, minimum = ctx.saved_tensors
        squares = 2 * squares
        gradient = torch.empty_like(features)
        for out, found, inside in zip(gradient, features, weight, strict=True):
            new = found * inside
            torch.addcmul(total, squares, new, out=out)
            out.addcmul_(highest, (new == maximum).to(out.dtype))
            out.addcmul_(lowest, (new == minimum).to(out.dtype))
            out.mul_(inside)
        return gradient, None


def summarise(statistics: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
    """
    Return the decoder's inputs, (B, 4 C, side, side, side) and (B, 1, ...), of view statistics.

    The first are mean, standard deviation, maximum and minimum over the views, the second is
    1 / count, which is 0 for a cell that no view saw. They are apart because processors are fast
    with multiples of 32 channels.
    """
    inverse = 1 / statistics['count'].clamp(min=1)
    mean = statistics['sum'] * inverse
    variance = (statistics['sum_squares'] * inverse - mean * mean).clamp(min=0)
    return torch.cat([mean, (variance + _MIN_VARIANCE).sqrt(), statistics['max'],
                      statistics['min']], dim=1), inverse * statistics['count'].clamp(max=1)
