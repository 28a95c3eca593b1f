"""Episodes under a policy or the oracle on held-out objects, measured view by view."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.errors import WeightsError
from active_recon.evaluation.oracle import oracle_batch, roll_out_oracle
from active_recon.evaluation.rollouts import batches, roll_out, Step
from active_recon.evaluation.statistics import by_object, mean_interval
from active_recon.geometry.cameras import azimuth_difference
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import Policy
from active_recon.volumes.voxels import entropy, iou, paper_entropy
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

BATCH = 128
"""Episodes that a network runs at once."""


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
    """
    Return the results of B episodes, from their steps and the truth (B, X, Y, Z) bool.

    Raises WeightsError where a step's occupancy is not finite.
    """
    measured: list[tuple[Tensor, ...]] = []
    taken = np.empty((len(truth), 0))
    for step in steps:
        occupancy, taken = step.occupancy, step.taken
        measured.append((iou(occupancy > threshold, truth.to(occupancy.device)),
                         entropy(occupancy), paper_entropy(occupancy)))
    found, full, paper = (torch.stack(each, dim=1).double().cpu().numpy()
                          for each in zip(*measured, strict=True))
    if not np.isfinite(full).all():  # as of NaN, of which no cell would be above a threshold
        raise WeightsError('not finite: expected an occupancy of finite numbers from the network, '
                           'got NaN; take other weights, or measure with --no-bf16')
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
    for part in batches(len(objects), BATCH):
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
