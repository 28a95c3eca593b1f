"""IoU over views, thresholds, and means with their spread."""

from active_recon.cameras import VIEW_COUNT
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import roll_out
from active_recon.models.reconstruction import ReconstructionNetwork
from active_recon.policies.base import Policy
from active_recon.voxels import iou
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

THRESHOLDS: NDArray[np.float64] = np.arange(0.10, 0.66, 0.05).round(2)


def episodes(views: ViewSet, starts: int, seed: int = 0) -> tuple[Tensor, Tensor]:
    """
    Return objects and first views of the episodes to measure, (N x starts,) each.

    Each object starts from `starts` different views; 24 starts are all of them.
    """
    order = np.random.default_rng(seed).random((len(views), VIEW_COUNT)).argsort(axis=1)
    objects = np.repeat(np.arange(len(views)), starts)
    return torch.from_numpy(objects), torch.from_numpy(order[:, :starts].reshape(-1))


def iou_per_view(
    network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
    starts: Tensor, thresholds: NDArray[np.float64], count: int = 5, batch: int = 64,
    swap_latents: bool = False,
) -> NDArray[np.float64]:
    """
    Return the IoU of every episode after every view at every threshold, (E, count, thresholds).

    `swap_latents` hands the policy the latent of another object (half a batch away).
    """
    result = np.empty((len(objects), count, len(thresholds)))
    for low in range(0, len(objects), batch):
        part = slice(low, low + batch)
        other = half_a_batch_away(len(objects[part])) if swap_latents else None
        rollout = roll_out(network, policy, views, objects[part], starts[part], count, other)
        truth = views.voxels[objects[part]]
        for t, step in enumerate(rollout):
            for k, threshold in enumerate(thresholds):
                result[part, t, k] = iou(step.occupancy > threshold, truth).numpy()
    return result


def half_a_batch_away(size: int) -> Tensor:
    """Return for each episode of a batch, (B,), the one whose latent it is given instead."""
    return torch.arange(size).roll(size // 2)


def object_bootstrap(values: NDArray[np.float64], objects: NDArray[np.int64], rounds: int = 2000,
                     seed: int = 0) -> tuple[float, float, float]:
    """
    Return the mean of values (E,) and its 95 % interval, by resampling the objects (E,).

    Episodes of one object are alike, so objects, not episodes, are drawn anew.
    """
    _, index = np.unique(objects, return_inverse=True)
    per_object = np.bincount(index, values) / np.bincount(index)
    rng = np.random.default_rng(seed)
    draws = rng.integers(len(per_object), size=(rounds, len(per_object)))
    low, high = np.percentile(per_object[draws].mean(axis=1), [2.5, 97.5])
    return float(per_object.mean()), float(low), float(high)
