"""Cells that look up what a view shows at their projection, and what several views agree on."""

from collections.abc import Mapping
from typing import Any

from active_recon.models.network import Cameras
import torch
from torch import nn, Tensor
from torch.autograd.function import FunctionCtx
from torch.nn import functional

GEOMETRY = 5
"""Numbers that tell how a view sees a cell: depth beyond the centre, ray direction, scale."""
_NEAREST = 0.05  # sides of the grid in front of the camera
_SPREAD = 0.01


def cell_centers(side: int, device: torch.device | None = None) -> Tensor:
    """Return the centres of a grid's cells, (N, 3) of a unit cube, indexed [x, y, z]."""
    along = (torch.arange(side, device=device) + 0.5) / side - 0.5
    return torch.stack(torch.meshgrid(along, along, along, indexing='ij'), -1).reshape(-1, 3)


def projection(cameras: Cameras, image_size: int) -> Tensor:
    """Return K [R t] in units in which the image reaches from -1 to 1, (B, 3, 4) float32."""
    poses, lenses = cameras.poses.double(), cameras.intrinsics.double()
    rotation = poses[:, :3, :3].transpose(1, 2)
    scale = torch.diag(torch.tensor([2 / image_size, 2 / image_size, 1.0],
                                    dtype=torch.float64, device=poses.device))
    scale[:2, 2] = -1
    with torch.autocast(poses.device.type, enabled=False):  # pixels are lost in half precision
        moved = -rotation @ poses[:, :3, 3:]
        return (scale @ lenses @ torch.cat([rotation, moved], dim=2)).float()


def projected(matrices: Tensor, side: int) -> tuple[Tensor, Tensor]:
    """
    Return where matrices (B, 3, 4) see the N centres of a grid's cells, in [x, y, z] order.

    Places are (B, N, 2), in units in which the image reaches from -1 to 1; depths (B, N).
    """
    along = (torch.arange(side, device=matrices.device) + 0.5) / side - 0.5
    axes = matrices[:, :, :3, None] * along + matrices[:, :, 3:, None] / 3  # (B, 3, 3, side)
    seen = (axes[:, :, 0, :, None] + axes[:, :, 1, None, :])[..., None] + axes[:, :, 2, None, None]
    seen = seen.flatten(2)  # (B, 3, N)
    depth = seen[:, 2]
    return (seen[:, :2] / depth[:, None].clamp(min=_NEAREST)).transpose(1, 2), depth


def sampled(maps: Tensor, where: Tensor) -> Tensor:
    """Return maps (B, C, h, w) at places (B, N, 2) in [-1, 1], (B, C, N); outside they are 0."""
    return functional.grid_sample(maps.float(), where[:, None], align_corners=False)[:, :, 0]


class Lookup(nn.Module):
    """What a view's map shows at each cell's projection."""

    def __init__(self, side: int) -> None:
        super().__init__()
        self._side = side

    def centers(self, maps: Tensor) -> Tensor:
        """Return the cells' centres, (N, 3), where the maps lie."""
        return cell_centers(self._side, maps.device)

    def found(self, maps: Tensor, seen: Tensor,
              matrices: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """
        Return features (B, C, N) of maps (B, C, h, w), their weights (B, 1, N), depths (B, N).

        A weight is 0 where the cell is behind the camera, beyond its image, or where that image
        is not `seen` (B, 1, h, w); else 1.
        """
        where, depth = projected(matrices, self._side)
        features = sampled(torch.cat([maps, seen.to(maps.dtype)], dim=1), where)
        inside = (features[:, -1] > 0.5) & (depth > _NEAREST)
        return features[:, :-1], inside[:, None].float(), depth

    def forward(self, maps: Tensor, seen: Tensor, cameras: Cameras,
                matrices: Tensor) -> tuple[Tensor, Tensor]:
        """Return features (B, C, N) of maps (B, C, h, w), and their weights (B, 1, N)."""
        features, weight, _ = self.found(maps, seen, matrices)
        return features, weight


class Lift(Lookup):
    """
    What a view's map and its geometry together say of each cell.

    The map holds what is added to the geometry's hidden features; both then are mixed into
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
        found, weight, depth = self.found(maps, seen, matrices)
        position = cameras.poses[:, :3, 3].float()
        rays = self.centers(maps).T - position[:, :, None]  # (B, 3, N)
        distance = position.norm(dim=1)[:, None, None]
        focal = cameras.intrinsics[:, 0, 0].float()[:, None, None] / seen.shape[-1]
        geometry = torch.cat([
            4 * (depth[:, None] - distance), rays / rays.norm(dim=1, keepdim=True),
            (focal / distance).log().expand(-1, -1, rays.shape[2])], dim=1)
        features = self.mix(functional.relu(found + self.geometry(geometry)))
        return features.float(), weight


def no_views(batch: int, channels: int, side: int, device: torch.device) -> dict[str, Tensor]:
    """Return what views agree on before there is any: (B, C, side, side, side) each."""
    empty = torch.zeros(batch, channels, side, side, side, device=device)
    return {'count': empty[:, :1], 'sum': empty, 'square': empty, 'most': empty, 'least': empty}


def gathered(known: Mapping[str, Tensor], features: Tensor, weight: Tensor) -> dict[str, Tensor]:
    """
    Return what views agree on with T more: features (T, B, C, N), weights 0 or 1 (T, B, 1, N).

    Their maximum is 0 at least and their minimum 0 at most: what no view saw.
    """
    new = (_Agreement.apply if features.requires_grad else _agreement)(features, weight)
    total, square, most, least = (part.reshape(known['sum'].shape) for part in new)
    return {'count': known['count'] + weight.sum(dim=0).reshape(known['count'].shape),
            'sum': known['sum'] + total, 'square': known['square'] + square,
            'most': torch.where(most > known['most'], most, known['most']),
            'least': torch.where(least < known['least'], least, known['least'])}


def _agreement(features: Tensor, weight: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return sum, sum of squares, maximum and minimum of (T, B, C, N) over T views."""
    new = features * weight
    return new.sum(dim=0), (new * new).sum(dim=0), new.amax(dim=0), new.amin(dim=0)


class _Agreement(torch.autograd.Function):
    """`_agreement` whose gradients take half the time of those that torch derives."""

    @staticmethod
    def forward(ctx: FunctionCtx, features: Tensor,
                weight: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return what `_agreement` returns."""
        found = _agreement(features, weight)
        ctx.save_for_backward(features, weight, *found[2:])
        return found

    @staticmethod
    def backward(ctx: Any, total: Tensor, square: Tensor, most: Tensor,
                 least: Tensor) -> tuple[Tensor, None]:
        """Return the gradient of the features; an extreme's goes to all views that reach it."""
        features, weight, highest, lowest = ctx.saved_tensors
        square = 2 * square
        gradient = torch.empty_like(features)
        for out, found, inside in zip(gradient, features, weight, strict=True):
            new = found * inside
            torch.addcmul(total, square, new, out=out)
            out.addcmul_(most, (new == highest).to(out.dtype))
            out.addcmul_(least, (new == lowest).to(out.dtype))
            out.mul_(inside)
        return gradient, None


def statistics(known: Mapping[str, Tensor]) -> Tensor:
    """Return mean, spread, maximum, minimum and how often seen, (B, 4 C + 1, side, ...)."""
    share = 1 / known['count'].clamp(min=1)
    mean = known['sum'] * share
    spread = ((known['square'] * share - mean * mean).clamp(min=0) + _SPREAD).sqrt()
    return torch.cat([mean, spread, known['most'], known['least'],
                      share * known['count'].clamp(max=1)], dim=1)
