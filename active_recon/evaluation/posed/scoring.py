"""All scores of one occupancy grid against one object's truth, by name."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property

from active_recon.evaluation.calibration import brier, near_surface, reliability
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.surfaces import (
    recall,
    SampledSurface,
    surface_scores,
    thin_cells,
    voxel_surface,
)
from active_recon.volumes.hidden import hidden_cells
from active_recon.volumes.occupancy_threshold import best_threshold
from active_recon.volumes.voxels import iou
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

Scores = dict[str, float]


@dataclass(frozen=True, eq=False)
class Target:
    """
    One object's truth.

    - cells: true voxels (R, R, R) bool, by R, cells a side
    - near: cells near the surface, at the finest resolution; thin: those of thin parts
    - surface: that of the finest voxels; None where surfaces are not measured
    """

    cells: Mapping[int, NDArray[np.bool_]]
    near: NDArray[np.bool_]
    thin: NDArray[np.bool_]
    surface: SampledSurface | None

    @property
    def finest(self) -> int:
        """Cells a side of the finest truth."""
        return max(self.cells)

    @cached_property
    def filled(self) -> Mapping[int, NDArray[np.bool_]]:
        """
        True voxels by R in which cells that no camera can tell (see `hidden_cells`) are occupied.

        So are those of truths that were made watertight from outside (Mescheder et al. 2019).
        """
        return {side: cells | hidden_cells(cells) for side, cells in self.cells.items()}


def target(cells: Mapping[int, NDArray[np.bool_]], surface: bool = True) -> Target:
    """Return an object's truth of its voxels by resolution, with its surface if `surface`."""
    finest = cells[max(cells)]
    return Target(cells, near_surface(finest), thin_cells(finest),
                  voxel_surface(finest, 0.5) if surface else None)


def pooled(values: NDArray[np.floating], side: int) -> NDArray[np.floating]:
    """
    Return values (R, R, R) max-pooled by 2 x 2 x 2 until there are `side` cells a side.

    A coarse cell is occupied if any of its fine cells is, as in the true voxels.
    """
    while len(values) > side:
        for axis in range(3):
            pairs = np.moveaxis(values, axis, 0)
            values = np.moveaxis(np.maximum(pairs[::2], pairs[1::2]), 0, axis)
    return values


def iou_scores(values: NDArray[np.floating], truths: Mapping[str, Mapping[int, NDArray[np.bool_]]],
               sides: tuple[int, ...], thresholds: Mapping[int, float]) -> Scores:
    """
    Return the IoU of values (R, R, R) above thresholds, `<name>_<cells a side>`.

    `truths` are true voxels by name and cells a side; sides that one lacks are left out.
    """
    scores: Scores = {}
    for side in sides:
        found = pooled(values, side) > thresholds[side]
        scores |= {f'{name}_{side}': float(iou(found, cells[side]))
                   for name, cells in truths.items() if side in cells}
    return scores


def fixed_scores(occupancy: NDArray[np.float32], truth: Target, entrant: Entrant) -> Scores:
    """Return `iou_*` and `filled_iou_*` of probabilities (R, R, R) at the entrant's thresholds."""
    return iou_scores(occupancy, {'iou': truth.cells, 'filled_iou': truth.filled}, entrant.sides,
                      entrant.thresholds)


def scored(logits: NDArray[np.float32], truth: Target, entrant: Entrant, count: int,
           surfaces: bool) -> tuple[Scores, dict[str, NDArray[np.float64]]]:
    """
    Return the scores of logits (R, R, R) after `count` views, and reliability diagrams.

    - `iou_*`: at the entrant's threshold, `filled_iou_*`: with the filled truth; `own_iou_*`: at
      the threshold chosen for the object; `expected_iou`: the expected IoU there
    - `brier` and the diagram `calibration_error`, near the surface, `thin_recall`, and
      `precision` (NaN where no cell is said to be occupied) and `recall` of all occupied cells:
      if the truth has the resolution of the logits
    - with the prefix `tempered_`: of logits divided by the entrant's temperatures, if it has any;
      for the object's threshold, by those fitted to cells anywhere
    - those of `SurfaceScores`, with `surfaces`
    """
    whole = expit(logits)
    scores = _own_scores(whole, truth, entrant, '')
    diagrams: dict[str, NDArray[np.float64]] = {}
    if entrant.grid_temperatures:
        cooled = logits / np.float32(entrant.grid_temperatures.get(count, 1.0))
        scores |= _own_scores(expit(cooled), truth, entrant, 'tempered_')
    if len(logits) == truth.finest:
        near, full = logits[truth.near], truth.cells[truth.finest][truth.near]
        kinds = {'': 1.0}
        if entrant.temperatures:
            kinds['tempered_'] = entrant.temperatures.get(count, 1.0)
        for prefix, temperature in kinds.items():
            occupancy = expit(near / np.float32(temperature))
            scores[f'{prefix}brier'] = brier(occupancy, full)
            diagrams[f'{prefix}calibration_error'] = reliability(occupancy, full)
    scores |= fixed_scores(whole, truth, entrant)
    threshold = entrant.thresholds[max(entrant.sides)]
    if len(logits) == truth.finest:
        found, wanted = whole > threshold, truth.cells[truth.finest]
        scores |= {'thin_recall': recall(found, truth.thin),
                   'precision': recall(wanted, found), 'recall': recall(found, wanted)}
    if surfaces and truth.surface is not None:
        scores |= asdict(surface_scores(voxel_surface(whole, threshold), truth.surface))
    return scores, diagrams


def _own_scores(occupancy: NDArray[np.float32], truth: Target, entrant: Entrant,
                prefix: str) -> Scores:
    """Return the scores of probabilities (R, R, R) at their own best threshold."""
    own, expected = best_threshold(occupancy)
    thresholds = dict.fromkeys(entrant.sides, own)
    return {f'{prefix}expected_iou': expected, **iou_scores(
        occupancy, {f'{prefix}own_iou': truth.cells}, entrant.sides, thresholds)}
