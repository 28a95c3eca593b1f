"""Everything that is said of a network and its policies on held-out objects, measured."""

from collections.abc import Callable
from dataclasses import dataclass, field
import math
from typing import Any

from active_recon.cameras import azimuth_difference
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.metrics import half_the_set_away, object_bootstrap
from active_recon.evaluation.rollouts import nearest_views, roll_out
from active_recon.models.reconstruction import ReconstructionNetwork
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.base import Policy
from active_recon.voxels import iou, turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

YAWS_DEG = (0, 5, 15, 30, 90, 180)
_BATCH = 64


@dataclass(frozen=True, eq=False)
class Episodes:
    """
    What E episodes brought, after each of T views.

    IoU, entropy and the paper's entropy in nats, (E, T); azimuths taken, radians, (E, T).
    """

    iou: NDArray[np.float64]
    entropy: NDArray[np.float64]
    paper_entropy: NDArray[np.float64]
    azimuths: NDArray[np.float64]

    @property
    def auc(self) -> NDArray[np.float64]:
        """Area under each episode's IoU curve, as its mean over the views, (E,)."""
        return np.asarray(self.iou.mean(axis=1))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Radians travelled by each episode, the short way from view to view, (E,)."""
        steps = azimuth_difference(self.azimuths[:, 1:], self.azimuths[:, :-1])
        return np.asarray(np.abs(steps).sum(axis=1))


def run_policy(network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
               starts: Tensor, threshold: float, count: int = 5,
               stand_ins: Tensor | None = None,
               progress: Callable[[int], None] = lambda done: None) -> Episodes:
    """Run all episodes (E,) under a policy, which is shown the stand-ins (E,) if there are any."""
    parts: list[Episodes] = []
    for low in range(0, len(objects), _BATCH):
        part = slice(low, low + _BATCH)
        own = objects[part]
        steps = list(roll_out(network, policy, views, own, starts[part], count,
                              None if stand_ins is None else stand_ins[part]))
        truth = views.voxels[own]
        grids = [[VoxelGrid(grid) for grid in step.occupancy.numpy()] for step in steps]
        parts.append(Episodes(
            np.stack([iou(step.occupancy > threshold, truth).numpy() for step in steps], axis=1),
            np.array([[grid.entropy() for grid in row] for row in grids]).T,
            np.array([[grid.paper_entropy() for grid in row] for row in grids]).T,
            steps[-1].taken))
        progress(len(own))
    return Episodes(*(np.concatenate([getattr(part, name) for part in parts])
                      for name in ('iou', 'entropy', 'paper_entropy', 'azimuths')))


def summary(episodes: Episodes, views: ViewSet, objects: Tensor) -> dict[str, Any]:
    """Return means with 95 % intervals over objects, and per category, ready for JSON."""
    index = objects.numpy()
    names = views.categories[index]
    return {
        'iou': [interval(episodes.iou[:, t], index) for t in range(episodes.iou.shape[1])],
        'auc': interval(episodes.auc, index),
        'entropy': episodes.entropy.mean(axis=0).tolist(),
        'paper_entropy': episodes.paper_entropy.mean(axis=0).tolist(),
        'rotation': interval(episodes.rotation, index),
        'per_category_iou': {str(name): episodes.iou[names == name].mean(axis=0).tolist()
                             for name in np.unique(names)},
    }


def interval(values: NDArray[np.float64], objects: NDArray[np.int64]) -> dict[str, float]:
    """Return mean, low and high (95 %, objects drawn anew) of values (E,)."""
    mean, low, high = object_bootstrap(values, objects)
    return {'mean': mean, 'low': low, 'high': high}


@torch.inference_mode()
def iou_by_yaw(network: ReconstructionNetwork, views: ViewSet, objects: Tensor, starts: Tensor,
               threshold: float) -> dict[str, dict[str, float]]:
    """
    Return the single-view IoU against a front that stands turned by each of YAWS_DEG.

    The network never sees the pose, so a front turned by a yaw leaves its answer as it is; what
    turns is the truth, by as much to the left as to the right.
    """
    found: dict[int, list[float]] = {yaw: [] for yaw in YAWS_DEG}
    for low in range(0, len(objects), _BATCH):
        own = objects[low:low + _BATCH]
        seen, _ = network(views.white(own, starts[low:low + _BATCH]))
        predicted = (seen.logits.sigmoid() > threshold).numpy()
        for row, (grid, item) in enumerate(zip(predicted, own.tolist(), strict=True)):
            sign = 1 if row % 2 else -1
            truth = views.voxels[item].numpy().astype(np.float32)
            for yaw in YAWS_DEG:
                at_yaw = turned(truth, sign * math.radians(yaw)) > 0.5
                found[yaw].append(float(iou(grid, at_yaw)))
    return {str(yaw): interval(np.array(values), objects.numpy())
            for yaw, values in found.items()}


@dataclass(frozen=True)
class Blindness:
    """What a policy does when it is shown the latent of another object instead of its own."""

    goal_change_deg: dict[str, float]
    auc: dict[str, float]
    auc_swapped: dict[str, float]
    auc_loss: dict[str, float] = field(default_factory=dict)


@torch.inference_mode()
def blindness(network: ReconstructionNetwork, policy: AttentionPolicy, views: ViewSet,
              objects: Tensor, starts: Tensor, threshold: float, count: int = 5) -> Blindness:
    """
    Swap every latent for another object's, seen from the same azimuths; measure what changes.

    `goal_change_deg`: how far the first goal moves, the start being the same. `auc_loss`: how
    much the area under the IoU curve falls, paired by episode; its interval tells whether it does.
    Raises DataError on a set of a single object.
    """
    stand_ins = half_the_set_away(objects, len(views))
    moved = []
    for low in range(0, len(objects), _BATCH):
        part = slice(low, low + _BATCH)
        taken = views.azimuths[objects[part], starts[part]].double().numpy()
        goals = []
        for shown in (objects[part], stand_ins[part]):
            alike = nearest_views(views.azimuths[shown].numpy(), taken)
            seen, _ = network(views.white(shown, alike))
            goals.append(policy.choose(seen.latent.numpy(), taken[:, None])[0].azimuth)
        moved.append(np.degrees(np.abs(azimuth_difference(*goals))))
    seeing = run_policy(network, policy, views, objects, starts, threshold, count)
    swapped = run_policy(network, policy, views, objects, starts, threshold, count, stand_ins)
    index = objects.numpy()
    return Blindness(interval(np.concatenate(moved), index), interval(seeing.auc, index),
                     interval(swapped.auc, index), interval(seeing.auc - swapped.auc, index))
