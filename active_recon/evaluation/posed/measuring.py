"""Entrants on the same views of a set's objects, after more and more of them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from active_recon.errors import ConfigError
from active_recon.evaluation.calibration import BINS
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.scene import Scene
from active_recon.evaluation.posed.scoring import iou_scores, scored, Target, target
from active_recon.evaluation.posed.walking import (
    even_orders,
    Order,
    random_orders,
    some_objects,
    walk,
)
from active_recon.evaluation.rollouts import batches, Observer
from active_recon.geometry.cameras import pose_directions
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
import torch
from torch import Tensor

COUNTS = (1, 2, 3, 5, 8, 12, 24)
KINDS = ('random', 'even')
_BATCH = 4  # objects at once


@dataclass(frozen=True)
class Plan:
    """
    What is measured.

    - counts: numbers of views, rising
    - surfaces: those of them after which surfaces are compared, at random views
    - seed: draws the views
    - bfloat16: networks run in half precision where that is safe
    """

    counts: tuple[int, ...] = COUNTS
    surfaces: tuple[int, ...] = (1, 5)
    seed: int = 0
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Reject counts that are none."""
        if not self.counts or min(self.counts) < 1 or list(self.counts) != sorted(
                set(self.counts)):
            raise ConfigError('counts: invalid numbers of views: expected rising ones from 1 on, '
                              f'such as 1,3,5, got {",".join(map(str, self.counts))}')

    def within(self, views: int) -> tuple[int, ...]:
        """Return the counts for which there are enough views; ConfigError where none is."""
        within = tuple(count for count in self.counts if count <= views)
        if not within:
            raise ConfigError(f'counts: too many views: expected {views} or fewer, as the objects '
                              f'have, got {",".join(map(str, self.counts))}')
        return within


@dataclass(frozen=True, eq=False)
class Measured:
    """
    What was measured of an entrant.

    - values: by kind of views and name, (N, K): each object after each count
    - diagrams: reliability of all objects together, by name, (K, 3, bins), at random views
    """

    values: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict)
    diagrams: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def note(self, kind: str, name: str, shape: tuple[int, int], at: tuple[int, int],
             value: float) -> None:
        """Keep one value of an object after a count; what is never noted is NaN."""
        of_kind = self.values.setdefault(kind, {})
        of_kind.setdefault(name, np.full(shape, np.nan))[at] = value


def orders_of(scene: Scene, plan: Plan) -> dict[str, list[Order]]:
    """Return the views of all objects for each count, (N, count), by kind."""
    counts = plan.within(scene.view_count)
    order = random_orders(len(scene), scene.view_count, plan.seed)
    directions = pose_directions(scene.views.poses.numpy())
    return {'random': [order[:, :count] for count in counts],
            'even': [even_orders(directions, count, order[:, 0]) for count in counts]}


def targets_of(scene: Scene, rows: Tensor, surface: bool = True) -> list[Target]:
    """Return the truths of objects (B,)."""
    return [target({side: cells[row].numpy() for side, cells in scene.truths.items()}, surface)
            for row in rows.tolist()]


def logits_of(scene: Scene, entrant: Entrant, rows: Tensor, orders: Sequence[Order],
              bfloat16: bool = False) -> Iterator[NDArray[np.float32]]:
    """Yield an entrant's logits of objects (B,), (B, R, R, R), after each of the set's orders."""
    shown = scene.shown_to(entrant.network)
    if shown is None:
        raise ConfigError(f'{entrant.name}: cannot be shown these views: expected objects that '
                          'are seen from 24 azimuths at an elevation of 30 degrees, as it was '
                          'trained on')
    observer = Observer(entrant.network, some_objects(shown, rows), bfloat16)
    own = [order[rows.numpy()] for order in orders]
    for logits in walk(observer, torch.arange(len(rows)), own):
        yield logits.cpu().numpy()


def measure(scene: Scene, entrants: Sequence[Entrant], plan: Plan,
            advance: Callable[[int], None] = lambda done: None) -> dict[str, Measured]:
    """
    Measure entrants on the same views of a set's objects; raises ConfigError as `logits_of`.

    `advance` is told of every object that was measured of an entrant.
    """
    counts, orders = plan.within(scene.view_count), orders_of(scene, plan)
    shape = len(scene), len(counts)
    found = {entrant.name: Measured() for entrant in entrants}
    for rows in batches(len(scene), _BATCH):
        targets = targets_of(scene, rows, bool(set(plan.surfaces) & set(counts)))
        for entrant in entrants:
            for kind in KINDS:
                steps = logits_of(scene, entrant, rows, orders[kind], plan.bfloat16)
                for step, logits in enumerate(steps):
                    for row, one, truth in zip(rows.tolist(), logits, targets, strict=True):
                        said = (scored(one, truth, entrant, counts[step],
                                       counts[step] in plan.surfaces) if kind == 'random' else
                                (iou_scores(expit(one), truth, entrant.sides,
                                            entrant.thresholds), {}))
                        _note(found[entrant.name], kind, shape, (row, step), said)
            advance(len(rows))
    return found


def _note(measured: Measured, kind: str, shape: tuple[int, int], at: tuple[int, int],
          said: tuple[dict[str, float], dict[str, NDArray[np.float64]]]) -> None:
    scores, diagrams = said
    for name, value in scores.items():
        measured.note(kind, name, shape, at, value)
    for name, diagram in diagrams.items():
        measured.diagrams.setdefault(name, np.zeros((shape[1], 3, BINS)))[at[1]] += diagram
