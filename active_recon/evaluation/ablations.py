"""Ablations: a wrong yaw of the front, and a policy with the latents of other objects."""

from collections.abc import Callable
from dataclasses import dataclass, field
import math

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.measure import BATCH, interval, run_policy
from active_recon.evaluation.metrics import swapped_objects
from active_recon.evaluation.rollouts import batches, nearest_views, Observer, RenderedObjects
from active_recon.geometry.cameras import azimuth_difference
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import Policy
from active_recon.volumes.voxels import iou, turned
import numpy as np
import torch
from torch import Tensor

YAWS_DEG = (0, 5, 15, 30, 90, 180)


@torch.inference_mode()
def iou_by_yaw(
    network: ReconstructionNetwork, views: ViewSet, objects: Tensor, starts: Tensor,
    threshold: float, progress: Callable[[int], None] = lambda done: None,
) -> dict[str, dict[str, float]]:
    """
    Return the single-view IoU with the object's front off by each of YAWS_DEG.

    The sign of the yaw alternates between episodes. The images are unchanged; the truth is
    rotated, and so are the cameras that the network gets.
    """
    found: dict[int, list[float]] = {yaw: [] for yaw in YAWS_DEG}
    observer = Observer(network, views)
    signs = 1 - 2 * (torch.arange(len(objects)) % 2)
    for part in batches(len(objects), BATCH):
        own = objects[part]
        turns = list(zip(own.tolist(), signs[part].tolist(), strict=True))
        for yaw in YAWS_DEG:
            angle = math.radians(yaw)
            state = observer.update(own, starts[part], observer.initial_state(len(own)),
                                    signs[part] * angle)
            predicted = (observer.occupancy(state) > threshold).cpu()
            truths = {turn: _turned_truth(views, turn[0], turn[1] * angle) for turn in set(turns)}
            found[yaw] += iou(predicted, torch.stack([truths[turn] for turn in turns])).tolist()
        progress(len(part))
    return {str(yaw): interval(np.array(values), objects) for yaw, values in found.items()}


def _turned_truth(views: ViewSet, item: int, yaw: float) -> Tensor:
    return torch.from_numpy(turned(views.voxels[item].numpy().astype(np.float32), yaw) > 0.5)


@dataclass(frozen=True)
class LatentSwap:
    """
    Result of the latent-swap ablation: a policy with the latent of another object or its own.

    Means with their 95 % intervals: `goal_change_deg`, the change of the first goal from the same
    start, degrees; `auc` and `auc_swapped`, the area under the IoU curve with the true and the
    swapped latents; `auc_loss`, their difference, paired by episode.
    """

    goal_change_deg: dict[str, float]
    auc: dict[str, float]
    auc_swapped: dict[str, float]
    auc_loss: dict[str, float] = field(default_factory=dict)


@torch.inference_mode()
def latent_swap_ablation(
    network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
    starts: Tensor, threshold: float, count: int = 5,
    progress: Callable[[int], None] = lambda done: None,
) -> LatentSwap:
    """
    Swap every latent for another object's, seen from the same azimuths; measure what changes.

    Raises DataError on a set of a single object.
    """
    observer = Observer(network, views)
    swapped = swapped_objects(objects, len(views))
    moved = []
    for part in batches(len(objects), BATCH):
        taken = views.azimuths[objects[part], starts[part]].double().numpy()
        own = RenderedObjects(observer, objects[part])
        own.reset()
        seen, goals = own.step(starts[part]), []
        for shown in (objects[part], swapped[part]):
            nearest = nearest_views(views.azimuths[shown].numpy(), taken)
            state = observer.update(shown, nearest, observer.initial_state(len(shown)))
            choice, _ = policy.choose(own.observation(state['latent'], seen),
                                      policy.initial_state(len(shown)))
            goals.append(own.goal_azimuths(choice))
        moved.append(np.degrees(np.abs(azimuth_difference(*goals))))
    with_own, with_swapped = (
        run_policy(network, policy, views, objects, starts, threshold, count, shown,
                   progress=progress).auc for shown in (None, swapped))
    return LatentSwap(interval(np.concatenate(moved), objects), interval(with_own, objects),
                      interval(with_swapped, objects), interval(with_own - with_swapped, objects))
