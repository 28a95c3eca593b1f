"""
What cameras have in sight of volumes of probabilities, sampled along lines of sight, in torch.

The rule is that of `policies.candidate_rendering`: cell i of a line is in sight with
T_i = prod_(j < i) (1 - p_j), and is what the line hits with T_i p_i. Here a line is sampled at
even steps instead of cut at each cell's border, which takes less time.
"""

from dataclasses import dataclass
import math

from active_recon.models.lifted import cell_centers
import torch
from torch import Tensor

RADIUS = math.sqrt(3) / 2
"""Of the sphere around the unit cube, sides of the grid."""
_WIDEST = 2.0  # tangent of half the field of view of a camera that stands near the cube
_UPRIGHT = 1e-3  # sine of the angle to the vertical below which a camera's own axes count


@dataclass(frozen=True, eq=False)
class Frames:
    """
    N cameras that are aimed at the grid's centre, upright, each (N, 3) but `distance` (N,).

    - origin, and the unit vectors forward, right and down, in the object's frame
    - spread: (N,), tangent of half the angle under which the sphere around the cube is seen
    """

    origin: Tensor
    forward: Tensor
    right: Tensor
    down: Tensor
    distance: Tensor
    spread: Tensor


def upright_frames(poses: Tensor) -> Frames:
    """
    Return the frames of cameras at poses (N, 4, 4), whatever their roll and aim.

    A camera that stands straight above or below the centre keeps its own roll.
    """
    origin = poses[:, :3, 3]
    distance = origin.norm(dim=1)
    forward = -origin / distance[:, None]
    level = torch.stack([forward[:, 1], -forward[:, 0], torch.zeros_like(distance)], dim=1)
    own = poses[:, :3, 0]
    own = own - (own * forward).sum(1, keepdim=True) * forward
    right = torch.where(level.norm(dim=1, keepdim=True) > _UPRIGHT, level, own)
    right = right / right.norm(dim=1, keepdim=True)
    widest = (distance.square() - RADIUS ** 2).clamp(min=(RADIUS / _WIDEST) ** 2).sqrt()
    return Frames(origin, forward, right, torch.linalg.cross(forward, right), distance,
                  RADIUS / widest)


def sampled_cells(frames: Frames, side: int, rays: int, steps: int) -> Tensor:
    """
    Return the cells at the samples of cameras' lines of sight, (N, steps, rays, rays).

    They are places in the flat grid of side x side x side cells, nearest first, and side ** 3
    outside it. The samples of a line lie evenly within the sphere around the grid.
    """
    device = frames.origin.device
    across = step_depths(rays, device) * frames.spread[:, None]
    towards = (frames.forward[:, None, None]
               + across[:, None, :, None] * frames.right[:, None, None]
               + across[:, :, None, None] * frames.down[:, None, None])
    towards = towards / towards.norm(dim=-1, keepdim=True)
    along = frames.distance[:, None] + step_depths(steps, device) * RADIUS
    points = (frames.origin[:, None, None, None]
              + along.clamp(min=0)[:, :, None, None, None] * towards[:, None])
    return _cells_at(points, side)


def step_depths(steps: int, device: torch.device | str = 'cpu') -> Tensor:
    """Return the middles of even steps from -1 (near) to 1 (far), (steps,)."""
    return (torch.arange(steps, device=device) + 0.5) / steps * 2 - 1


def passing(occupied: Tensor) -> Tensor:
    """Return how likely nothing is before each sample, of occupancies (N, steps, ...)."""
    free = (1 - occupied).cumprod(dim=1)
    return torch.cat([torch.ones_like(free[:, :1]), free[:, :-1]], dim=1)


def cells_in_sight(frames: Frames, occupied: Tensor, side: int) -> Tensor:
    """
    Return how likely each cell was in sight of each of N cameras, (N, side ** 3) in [0, 1].

    Takes occupancies at the cameras' own samples, (N, steps, rays, rays). What counts is what lies
    a step or more before a cell: a cell does not hide itself.
    """
    device, (steps, rays) = occupied.device, occupied.shape[1:3]
    away = cell_centers(side, device) - frames.origin[:, None]  # (N, cells, 3)
    depth = (away * frames.forward[:, None]).sum(-1).clamp(min=1e-6)
    column, row = (((away * axis[:, None]).sum(-1) / depth / frames.spread[:, None] + 1) / 2 * rays
                   for axis in (frames.right, frames.down))
    step = ((away.norm(dim=-1) - frames.distance[:, None]) / RADIUS + 1) / 2 * steps
    column, row = (each.long().clamp(0, rays - 1) for each in (column, row))
    place = (step.long().clamp(0, steps - 1) * rays + row) * rays + column
    return passing(occupied).flatten(1).gather(1, place)


def _cells_at(points: Tensor, side: int) -> Tensor:
    """Return the cells that hold points (..., 3), by their places; side ** 3 beyond the grid."""
    where = torch.floor((points + 0.5) * side).long()
    inside = ((where >= 0) & (where < side)).all(dim=-1)
    place = (where[..., 0] * side + where[..., 1]) * side + where[..., 2]
    return torch.where(inside, place, side ** 3)
