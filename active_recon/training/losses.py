"""The reconstruction's losses of section 3.2, as means."""

from active_recon.config import LossConfig
from active_recon.silhouettes import project
import torch
from torch import Tensor
from torch.nn import functional


def volume_loss(logits: Tensor, voxels: Tensor, kind: str) -> Tensor:
    """Return L(V), a scalar: logits and voxels (B, X, Y, Z); kind is mse, bce or dice."""
    if kind == 'bce':
        return functional.binary_cross_entropy_with_logits(logits, voxels)
    occupancy = logits.sigmoid()
    if kind == 'dice':
        shared = 2 * (occupancy * voxels).sum((1, 2, 3)) + 1
        return (1 - shared / (occupancy.sum((1, 2, 3)) + voxels.sum((1, 2, 3)) + 1)).mean()
    return functional.mse_loss(occupancy, voxels)


def silhouette_loss(logits: Tensor, voxels: Tensor, frusta: Tensor) -> Tensor:
    """Return L(S) over one camera for each object, a scalar: frusta (B, D, S, S, 3)."""
    with torch.no_grad():
        truth = project(voxels, frusta)
    return functional.mse_loss(project(logits.sigmoid(), frusta), truth)


def reconstruction_loss(sequence: list[Tensor], voxels: Tensor, frusta: Tensor, seen_at: int,
                        config: LossConfig) -> tuple[Tensor, dict[str, float]]:
    """
    Return lambda_V L(V) + lambda_S L(S) of a sequence of logits (B, X, Y, Z), and its parts.

    The volume loss is the mean over the views; the silhouettes, which cost more than the network
    itself, are compared after the one view `seen_at`, from one camera for each object.
    """
    volume = torch.stack(
        [volume_loss(logits.float(), voxels, config.volume_loss) for logits in sequence]).mean()
    total = config.volume_weight * volume
    parts = {'volume': volume.item()}
    if config.silhouette_weight > 0:
        silhouette = silhouette_loss(sequence[seen_at].float(), voxels, frusta)
        total = total + config.silhouette_weight * silhouette
        parts['silhouette'] = silhouette.item()
    return total, parts
