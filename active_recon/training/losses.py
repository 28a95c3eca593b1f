"""The reconstruction's losses of section 3.2, as means."""

from active_recon.config import LossConfig
from active_recon.volumes.silhouettes import project
import torch
from torch import Tensor
from torch.nn import functional


def volume_loss(logits: Tensor, voxels: Tensor, kind: str) -> Tensor:
    """
    Return L(V), a scalar: logits and voxels (B, R, R, R); kind is one of VOLUME_LOSSES.

    Squared error (mse, the paper's) gives every voxel the same weight, and most are empty. Dice
    measures the overlap with the object, so that thin objects count as much as solid ones.
    """
    if kind == 'bce':
        return functional.binary_cross_entropy_with_logits(logits, voxels)
    occupancy = logits.sigmoid()
    if kind == 'mse':
        return functional.mse_loss(occupancy, voxels)
    shared = 2 * (occupancy * voxels).sum((1, 2, 3)) + 1
    dice = (1 - shared / (occupancy.sum((1, 2, 3)) + voxels.sum((1, 2, 3)) + 1)).mean()
    if kind == 'dice':
        return dice
    return volume_loss(logits, voxels, kind.removesuffix('+dice')) + dice / 2


def silhouette_loss(logits: Tensor, voxels: Tensor, frusta: Tensor) -> Tensor:
    """Return L(S) over one camera for each object, a scalar: frusta (B, D, S, S, 3)."""
    with torch.no_grad():
        truth = project(voxels, frusta)
    return functional.mse_loss(project(logits.sigmoid(), frusta), truth)


def reconstruction_loss(logits: Tensor, voxels: Tensor, frusta: Tensor,
                        config: LossConfig) -> tuple[Tensor, dict[str, Tensor]]:
    """
    Return lambda_V L(V) + lambda_S L(S) of logits (B, R, R, R), and its parts.

    Silhouettes are compared from one camera for each object, frusta (B, D, S, S, 3).
    """
    volume = volume_loss(logits, voxels, config.volume_loss)
    total = config.volume_weight * volume
    parts = {'volume': volume.detach()}
    if config.silhouette_weight > 0:
        silhouette = silhouette_loss(logits, voxels, frusta)
        total = total + config.silhouette_weight * silhouette
        parts['silhouette'] = silhouette.detach()
    return total, parts
