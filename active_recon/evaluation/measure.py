"""Measurement of a network and its policies on held-out objects."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields
import math
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.metrics import swapped_objects
from active_recon.evaluation.oracle import oracle_batch, roll_out_oracle
from active_recon.evaluation.rollouts import (
    batches,
    nearest_views,
    Observer,
    RenderedObjects,
    roll_out,
    Step,
)
from active_recon.evaluation.statistics import by_object, mean_interval
from active_recon.geometry.cameras import azimuth_difference
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import Policy
from active_recon.volumes.voxels import entropy, iou, paper_entropy, turned
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

YAWS_DEG = (0, 5, 15, 30, 90, 180)
_BATCH = 128


@dataclass(frozen=True, eq=False)
class Episodes:
    """
    The results of E episodes after each of T views.

    IoU in [0, 1], entropy and the paper's entropy in nats, and the azimuths of the views taken in
    radians, (E, T) each.
    """

    iou: NDArray[np.float64]
    entropy: NDArray[np.float64]
    paper_entropy: NDArray[np.float64]
    azimuths: NDArray[np.float64]

    @property
    def auc(self) -> NDArray[np.float64]:
        """Area under each episode's IoU curve, i.e. the mean over its views, (E,)."""
        return np.asarray(self.iou.mean(axis=1))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Rotation travelled in each episode, the short way between views, radians, (E,)."""
        steps = azimuth_difference(self.azimuths[:, 1:], self.azimuths[:, :-1])
        return np.asarray(np.abs(steps).sum(axis=1))


def joined(parts: Sequence[Episodes]) -> Episodes:
    """Return the episodes of all parts, concatenated."""
    return Episodes(*(np.concatenate([getattr(part, name.name) for part in parts])
                      for name in fields(Episodes)))


def record(steps: Iterable[Step], truth: Tensor, threshold: float) -> Episodes:
    """Return the results of B episodes, from their steps and the truth (B, X, Y, Z) bool."""
    measured: list[tuple[Tensor, ...]] = []
    taken = np.empty((len(truth), 0))
    for step in steps:
        occupancy, taken = step.occupancy, step.taken
        measured.append((iou(occupancy > threshold, truth.to(occupancy.device)),
                         entropy(occupancy), paper_entropy(occupancy)))
    found, full, paper = (torch.stack(each, dim=1).double().cpu().numpy()
                          for each in zip(*measured, strict=True))
    return Episodes(found, full, paper, taken)


def run_policy(network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
               starts: Tensor, threshold: float, count: int = 5,
               swapped: Tensor | None = None, bfloat16: bool = False,
               progress: Callable[[int], None] = lambda done: None) -> Episodes:
    """
    Run episodes under a policy and return their results.

    `objects` and `starts`, (E,), are the object and the first view of each; `count` is the number
    of views. For `swapped` see `roll_out`. `progress` gets the number of episodes just finished.
    """
    parts = []
    for part in batches(len(objects), _BATCH):
        steps = roll_out(network, policy, views, objects[part], starts[part], count,
                         None if swapped is None else swapped[part], bfloat16)
        parts.append(record(steps, views.voxels[objects[part]], threshold))
        progress(len(part))
    return joined(parts)


def run_oracle(network: ReconstructionNetwork, views: ViewSet, objects: Tensor, starts: Tensor,
               threshold: float, count: int = 5, bfloat16: bool = False,
               progress: Callable[[int], None] = lambda done: None) -> Episodes:
    """Run episodes as `run_policy` does, but under the greedy oracle, which uses the truth."""
    parts = []
    for part in batches(len(objects), oracle_batch(views)):
        own = objects[part]
        steps = roll_out_oracle(network, views, own, starts[part], count, threshold, bfloat16)
        parts.append(record(steps, views.voxels[own], threshold))
        progress(len(part))
    return joined(parts)


def summary(runs: Sequence[Episodes], views: ViewSet, objects: Tensor) -> dict[str, Any]:
    """
    Return means with 95 % intervals, overall and per category, ready for JSON.

    `runs` has the same episodes for each seed of a policy.
    """
    def stacked(name: str) -> NDArray[np.float64]:
        """Return (T, objects, starts, seeds), or without T."""
        values = np.stack([by_object(getattr(run, name), objects.numpy()) for run in runs], 2)
        return np.moveaxis(values, 3, 0) if values.ndim == 4 else values

    categories = views.categories[np.unique(objects.numpy())]
    ious = stacked('iou')
    return {
        'seeds': len(runs),
        'iou': [asdict(mean_interval(values)) for values in ious],
        'auc': asdict(mean_interval(stacked('auc'))),
        'entropy': [asdict(mean_interval(values)) for values in stacked('entropy')],
        'paper_entropy': [asdict(mean_interval(values)) for values in stacked('paper_entropy')],
        'rotation': asdict(mean_interval(stacked('rotation'))),
        'per_category_iou': {
            str(name): [asdict(mean_interval(values[categories == name])) for values in ious]
            for name in np.unique(categories)},
    }


def interval(values: NDArray[np.float64], objects: Tensor) -> dict[str, float]:
    """Return the mean of values of episodes (E,) and both ends of its 95 % interval."""
    return asdict(mean_interval(by_object(values, objects.numpy())))


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
    for part in batches(len(objects), _BATCH):
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
    Measure a policy when every latent is that of another object from the same azimuths.

    Raises DataError on a set with a single object.
    """
    observer = Observer(network, views)
    swapped = swapped_objects(objects, len(views))
    moved = []
    for part in batches(len(objects), _BATCH):
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
