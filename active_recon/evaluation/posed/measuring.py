"""Measurement of entrants on the same views of a set's objects, by number of views."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from active_recon.errors import ConfigError
from active_recon.evaluation.calibration import BINS
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.scene import Scene
from active_recon.evaluation.posed.scoring import fixed_scores, scored, Target, target
from active_recon.evaluation.posed.walking import (
    even_orders,
    Order,
    random_orders,
    some_objects,
    walk,
)
from active_recon.evaluation.rollouts import batches, Observer
from active_recon.geometry.view_distance import pose_directions
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
    The plan of a measurement.

    - counts: numbers of views after which to measure, increasing
    - surfaces: those of them after which surfaces are compared, with random views
    - seed: of the random views
    - bfloat16: networks run in mixed precision

    Raises ConfigError where the counts are not increasing from 1 or more.
    """

    counts: tuple[int, ...] = COUNTS
    surfaces: tuple[int, ...] = (1, 5)
    seed: int = 0
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Reject invalid counts."""
        if not self.counts or min(self.counts) < 1 or list(self.counts) != sorted(
                set(self.counts)):
            raise ConfigError('counts: invalid numbers of views: expected increasing ones of 1 or '
                              f'more, e.g. 1,3,5, got {",".join(map(str, self.counts))}')

    def within(self, views: int) -> tuple[int, ...]:
        """Return the counts up to a number of views; raises ConfigError where there is none."""
        within = tuple(count for count in self.counts if count <= views)
        if not within:
            raise ConfigError(f'counts: too many views: expected at most the {views} of the '
                              f'objects, got {",".join(map(str, self.counts))}')
        return within


@dataclass(frozen=True, eq=False)
class Measured:
    """
    The measured values of an entrant.

    - values: by kind of views (random, even) and name, (N, K): each object after each count
    - diagrams: reliability diagrams over all objects, by name, (K, 3, bins), with random views
    """

    values: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict)
    diagrams: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def note(self, kind: str, name: str, shape: tuple[int, int], at: tuple[int, int],
             value: float) -> None:
        """Set the value of one object after one count; values that are not set are NaN."""
        of_kind = self.values.setdefault(kind, {})
        of_kind.setdefault(name, np.full(shape, np.nan))[at] = value


def orders_of(scene: Scene, plan: Plan) -> dict[str, list[Order]]:
    """Return the indices of the views for each count, (N, count), by kind of views."""
    counts = plan.within(scene.view_count)
    order = random_orders(len(scene), scene.view_count, plan.seed)
    directions = pose_directions(scene.views.poses.numpy())
    return {'random': [order[:, :count] for count in counts],
            'even': [even_orders(directions, count, order[:, 0]) for count in counts]}


def targets_of(scene: Scene, rows: Tensor, surface: bool = True) -> list[Target]:
    """Return the truths of objects (B,), with their surfaces if `surface`."""
    return [target({side: cells[row].numpy() for side, cells in scene.truths.items()}, surface)
            for row in rows.tolist()]


def logits_of(scene: Scene, entrant: Entrant, rows: Tensor, orders: Sequence[Order],
              bfloat16: bool = False) -> Iterator[NDArray[np.float32]]:
    """
    Yield an entrant's logits (B, R, R, R) for objects (B,) after the views of each order.

    `orders` are of all N objects. Raises ConfigError where the network cannot use the views.
    """
    shown = scene.shown_to(entrant.network)
    if shown is None:
        raise ConfigError(f'{entrant.name}: cannot use these views: expected 24 azimuths at an '
                          'elevation of 30 degrees, as in its training, got others')
    observer = Observer(entrant.network, some_objects(shown, rows), bfloat16)
    own = [order[rows.numpy()] for order in orders]
    for logits in walk(observer, torch.arange(len(rows)), own):
        yield logits.cpu().numpy()


def measure(scene: Scene, entrants: Sequence[Entrant], plan: Plan,
            advance: Callable[[int], None] = lambda done: None) -> dict[str, Measured]:
    """
    Measure entrants on the same views of a set's objects; return the values by entrant.

    `advance` gets the number of objects just measured with an entrant. Raises ConfigError as
    `logits_of` does.
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
                        result = (scored(one, truth, entrant, counts[step],
                                         counts[step] in plan.surfaces) if kind == 'random' else
                                  (fixed_scores(expit(one), truth, entrant), {}))
                        _note(found[entrant.name], kind, shape, (row, step), result)
            advance(len(rows))
    return found


def _note(measured: Measured, kind: str, shape: tuple[int, int], at: tuple[int, int],
          result: tuple[dict[str, float], dict[str, NDArray[np.float64]]]) -> None:
    scores, diagrams = result
    for name, value in scores.items():
        measured.note(kind, name, shape, at, value)
    for name, diagram in diagrams.items():
        measured.diagrams.setdefault(name, np.zeros((shape[1], 3, BINS)))[at[1]] += diagram
