"""What a network makes of some validation objects, for people to look at while it trains."""

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import Observer
from active_recon.models.network import ReconstructionNetwork
import cv2
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_OBJECTS, _VIEWS = 4, 3
_TILE = 128  # pixels


@torch.inference_mode()
def progress_picture(network: ReconstructionNetwork, views: ViewSet) -> NDArray[np.uint8]:
    """
    Return a row for each of a few objects, (rows x 128, 7 x 128, 3) uint8 RGB.

    Three views, then what the network makes of them, from the side and from above, and beside
    each what is true: the whiter, the more occupied is the fullest cell behind a pixel.
    """
    objects = torch.linspace(0, len(views) - 1, min(_OBJECTS, len(views))).long()
    shown = np.linspace(0, views.azimuths.shape[1], _VIEWS, endpoint=False).astype(int)
    observer = Observer(network, views)
    state = observer.initial_state(len(objects))
    tiles: list[Tensor] = []
    for view in shown:
        chosen = torch.full_like(objects, int(view))
        tiles.append(views.white(objects, chosen)[:, :3].permute(0, 2, 3, 1))
        state = observer.update(objects, chosen, state)
    occupancy, truth = observer.occupancy(state).cpu(), views.voxels[objects].float()
    for axis in (2, 3):  # along y, then along z
        tiles += [_seen_along(axis, grid) for grid in (occupancy, truth)]
    return np.concatenate([_resized(tile) for tile in tiles], axis=1)


def _seen_along(axis: int, grids: Tensor) -> Tensor:
    """Return the fullest cell along an axis of grids (B, X, Y, Z), upright, (B, R, R, 3)."""
    seen = grids.amax(dim=axis).transpose(1, 2).flip(1)
    return seen[..., None].expand(-1, -1, -1, 3)


def _resized(images: Tensor) -> NDArray[np.uint8]:
    """Return images (B, H, W, 3) in [0, 1] as tiles below each other, (B x 128, 128, 3)."""
    pixels = (images.float() * 255).round().byte().numpy()
    return np.concatenate([np.asarray(cv2.resize(
        image, (_TILE, _TILE), interpolation=cv2.INTER_NEAREST), np.uint8) for image in pixels])
