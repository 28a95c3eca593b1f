"""The episodes to measure, and the IoU after each view at several thresholds."""

from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.evaluation.rollouts import roll_out
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import Policy
from active_recon.volumes.voxels import iou
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

THRESHOLDS: NDArray[np.float64] = np.arange(0.10, 0.66, 0.05).round(2)
_MOST_EPISODES, _MOST_STATE_BYTES = 128, 2 ** 28  # of one batch


def episodes(views: ViewSet, starts: int, seed: int = 0) -> tuple[Tensor, Tensor]:
    """
    Return the objects and the first views of the episodes to measure, (N x starts,) each.

    Each object has episodes from `starts` different views, drawn by the seed; at most all.
    """
    order = np.random.default_rng(seed).random(views.azimuths.shape).argsort(axis=1)
    chosen = order[:, :starts]
    objects = np.repeat(np.arange(len(views)), chosen.shape[1])
    return torch.from_numpy(objects), torch.from_numpy(chosen.reshape(-1))


def iou_per_view(
    network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
    starts: Tensor, thresholds: NDArray[np.float64], count: int = 5, batch: int | None = None,
) -> NDArray[np.float64]:
    """
    Return the IoU of E episodes after each view at each of K thresholds, (E, count, K).

    `batch` episodes run at once: without it 128, or fewer of a network whose state is large.
    """
    if batch is None:
        state_bytes = sum(part.nbytes for part in network.initial_state(1).values())
        batch = min(_MOST_EPISODES, max(1, _MOST_STATE_BYTES // state_bytes))
    result = np.empty((len(objects), count, len(thresholds)))
    for low in range(0, len(objects), batch):
        part = slice(low, low + batch)
        rollout = roll_out(network, policy, views, objects[part], starts[part], count)
        for t, step in enumerate(rollout):
            truth = views.voxels[objects[part]].to(step.occupancy.device)
            for k, threshold in enumerate(thresholds):
                result[part, t, k] = iou(step.occupancy > threshold, truth).cpu().numpy()
    return result


def swapped_objects(objects: Tensor, count: int) -> Tensor:
    """
    Return another object for each of objects (E,) of a set of `count`: the index half a set away.

    In a set sorted by category it usually has another category. Raises DataError on a set of
    fewer than two objects.
    """
    if count < 2:
        raise DataError('too few objects: expected two or more to swap their latents, got '
                        f'{count}')
    return (objects + count // 2) % count
