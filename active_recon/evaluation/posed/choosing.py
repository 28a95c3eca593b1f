"""Choice of thresholds and temperatures on validation objects."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from active_recon.evaluation.calibration import fit_temperatures
from active_recon.evaluation.metrics import THRESHOLDS
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.measuring import logits_of, orders_of, Plan, targets_of
from active_recon.evaluation.posed.scene import Scene
from active_recon.evaluation.posed.scoring import iou_scores, Target
from active_recon.evaluation.rollouts import batches
import numpy as np
from numpy.typing import NDArray
from scipy.special import logit

_BATCH = 4
_CELLS = 2000  # cells sampled from each object, near its surface and anywhere


@dataclass(eq=False)
class _Cells:
    """Sampled cells of every object: logits by number of views, and the truth."""

    logits: dict[int, list[NDArray[np.float32]]]
    truth: list[NDArray[np.bool_]]

    def temperatures(self) -> dict[int, float]:
        """Return the maximum-likelihood temperatures, by number of views."""
        if not all(self.logits.values()):
            return {}
        return fit_temperatures({count: np.concatenate(parts)
                                 for count, parts in self.logits.items()},
                                np.concatenate(self.truth))


@dataclass(eq=False)
class _Totals:
    """Results of an entrant over validation objects: sums of IoU, and sampled cells."""

    iou: dict[int, NDArray[np.float64]]  # by cells a side: at each threshold, over all counts
    near: _Cells
    anywhere: _Cells


def choose(scene: Scene, entrants: Sequence[Entrant], plan: Plan, source: str,
           advance: Callable[[int], None] = lambda done: None) -> list[Entrant]:
    """
    Return the entrants with thresholds and temperatures chosen on validation objects.

    Thresholds maximise the mean IoU over all counts of random views; temperatures maximise the
    likelihood of cells near the surface, and of cells anywhere. Entrants that cannot use the
    views are returned unchanged. `source` names the validation objects.
    """
    return [_chosen(scene, entrant, plan, source, advance)
            if scene.shown_to(entrant.network) is not None else entrant for entrant in entrants]


def _chosen(scene: Scene, entrant: Entrant, plan: Plan, source: str,
            advance: Callable[[int], None]) -> Entrant:
    counts, orders = plan.within(scene.view_count), orders_of(scene, plan)['random']
    sides = [side for side in entrant.sides if side in scene.truths]
    totals = _Totals({side: np.zeros(len(THRESHOLDS)) for side in sides},
                     _Cells({count: [] for count in counts}, []),
                     _Cells({count: [] for count in counts}, []))
    for rows in batches(len(scene), _BATCH):
        targets = targets_of(scene, rows, surface=False)
        cells = [_some_cells(truth, plan.seed + row)
                 for row, truth in zip(rows.tolist(), targets, strict=True)]
        for truth, own in zip(targets, cells, strict=True):
            for kind, some in zip((totals.near, totals.anywhere), own, strict=True):
                kind.truth.append(truth.cells[truth.finest].ravel()[some])
        steps = logits_of(scene, entrant, rows, orders, plan.bfloat16)
        for count, logits in zip(counts, steps, strict=True):
            for one, truth, own in zip(logits, targets, cells, strict=True):
                _add_scores(totals, count, one, truth, own, tuple(sides))
        advance(len(rows))
    thresholds = dict(entrant.thresholds) | {
        side: float(THRESHOLDS[total.argmax()]) for side, total in totals.iou.items()}
    return replace(entrant, thresholds=thresholds, temperatures=totals.near.temperatures(),
                   grid_temperatures=totals.anywhere.temperatures(), chosen_on=source)


def _add_scores(totals: _Totals, count: int, logits: NDArray[np.float32], truth: Target,
                cells: tuple[NDArray[np.int64], NDArray[np.int64]],
                sides: tuple[int, ...]) -> None:
    for place, threshold in enumerate(THRESHOLDS):
        at = dict.fromkeys(sides, float(logit(threshold)))
        for name, value in iou_scores(logits, {'': truth.cells}, sides, at).items():
            totals.iou[int(name.strip('_'))][place] += value
    if len(logits) == truth.finest:
        for kind, some in zip((totals.near, totals.anywhere), cells, strict=True):
            kind.logits[count].append(logits.ravel()[some])


def _some_cells(truth: Target, seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return random cells near a shape's surface and anywhere, as indices of the flat grid."""
    rng, near = np.random.default_rng(seed), np.flatnonzero(truth.near)
    if len(near) > _CELLS:
        near = rng.choice(near, _CELLS, replace=False)
    return near, rng.integers(truth.near.size, size=_CELLS)
