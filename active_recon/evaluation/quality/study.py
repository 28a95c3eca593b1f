"""Whether what is said of quality holds: on objects that nothing was fitted to."""

from collections.abc import Mapping
from typing import Any

from active_recon.evaluation.quality.faults import FAULTS
from active_recon.evaluation.quality.fitting import numbers_of
from active_recon.evaluation.quality.measuring import LEARNED, Measured
from active_recon.evaluation.quality.promises import Episodes, kept_at_least, one_of_each
from active_recon.evaluation.quality.shells import HOLLOW
from active_recon.evaluation.statistics import difference, mean_interval
from active_recon.quality.judge import Judge
from active_recon.quality.quality import Quality
from active_recon.quality.tables import QualityTables
import numpy as np
from numpy.typing import NDArray

FULL = 5
"""Views of an episode that does not stop early."""


def study(measured: Measured, tables: QualityTables) -> dict[str, Any]:
    """
    Return the figures of a set, ready for JSON.

    - objects, hollow: numbers; sources
    - views: by number of views, `error` of the expected IoU (mean absolute, with its interval
      over objects) and `covered`, the share above the lower bound, of objects that are not hollow
      and of `all`, each missing where there are none; `flagged`: false alarms among all
    - faults: by name and number of views, the shares `flagged` and `named` rightly
    - promises: by order of views and target, see `_promise`
    """
    judge = Judge(tables)
    numbers = numbers_of(measured, tables.known_latents)
    judged = [judge.judge_numbers(row, int(count), bool(around)) for row, count, around in zip(
        numbers, measured.count, measured.around, strict=True)]
    usual = measured.fault == ''
    solid = usual & (measured.hollow <= HOLLOW)
    expected = np.array([quality.expected_iou for quality in judged])
    names = {name: bool(share > HOLLOW) for name, share in zip(
        measured.object.tolist(), measured.hollow.tolist(), strict=True)}
    return {
        'objects': len(names), 'hollow': sum(names.values()),
        'sources': sorted(set(measured.source.tolist())),
        'views': {str(count): _after(measured, judged, expected, usual, solid, count)
                  for count in np.unique(measured.count[usual]).tolist()},
        'faults': {fault: {str(count): _found(
            fault, [judged[row] for row in np.flatnonzero(
                (measured.fault == fault) & (measured.count == count))])
            for count in np.unique(measured.count[measured.fault == fault]).tolist()}
            for fault in FAULTS if (measured.fault == fault).any()},
        'promises': {kind: {f'{target:g}': _promise(
            measured.rows(solid & (measured.kind == kind)),
            expected[solid & (measured.kind == kind)], target, needed, tables)
            for target, needed in zip(
                tables.targets, tables.needed_where(kind == LEARNED), strict=True)}
            for kind in np.unique(measured.kind[solid]).tolist()}}


def _after(measured: Measured, judged: list[Quality], expected: NDArray[np.float64],
           usual: NDArray[np.bool_], solid: NDArray[np.bool_], count: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    error = np.abs(expected - measured.iou)
    above = np.array([quality.lower_bound for quality in judged]) <= measured.iou
    for name, chosen in (('solid', solid), ('all', usual)):
        rows = chosen & (measured.count == count)
        if rows.any():
            spread = mean_interval(_by_object(error[rows], measured.object[rows]))
            found[name] = {'episodes': int(rows.sum()), 'iou': float(measured.iou[rows].mean()),
                           'error': [spread.mean, spread.low, spread.high],
                           'covered': float(above[rows].mean())}
    at = np.flatnonzero(usual & (measured.count == count))
    return {**found, 'flagged': float(np.mean([bool(judged[row].suspect) for row in at]))}


def _by_object(values: NDArray[np.float64], objects: NDArray[np.str_]) -> NDArray[np.float64]:
    """Return the mean of each object's values: its episodes are not independent."""
    _, at = np.unique(objects, return_inverse=True)
    return np.asarray(np.bincount(at, values) / np.bincount(at))


def _found(fault: str, judged: list[Quality]) -> Mapping[str, float]:
    return {'episodes': len(judged),
            'flagged': float(np.mean([bool(quality.suspect) for quality in judged])),
            'named': float(np.mean([quality.suspect == fault for quality in judged]))}


def _promise(measured: Measured, expected: NDArray[np.float64], target: float, needed: float,
             tables: QualityTables) -> dict[str, Any]:
    """
    Return how a target is kept: by episodes that stop, and against always so many views.

    - stopped: episodes that did, out of `episodes`; kept: the share of them at or above the
      target, and its exact 95 % bound `kept_at_least`, by one episode of each object
    - views and change: of all episodes, with five views (or all, where an object has fewer) where
      they do not stop, the mean number of views, and the difference of IoU from always so many,
      with its interval over objects
    - given_up: share of all told after one to four views that the target is out of reach;
      wrongly: share of those that reach it by the last view
    """
    episodes = Episodes.of(measured, expected)
    objects = measured.object[np.unique(measured.episode, return_index=True)[1]]
    at, ious = episodes.stops(needed), episodes.stopped(needed)
    own = one_of_each(measured)
    sure = Episodes.of(measured.rows(own), expected[own]).stopped(needed)
    full = np.minimum(FULL, np.isfinite(episodes.iou).sum(axis=1)) - 1
    ends = np.where((at >= 0) & (at < full), at, full)
    rows = np.arange(len(at))
    change = difference(_by_object(episodes.iou[rows, ends], objects),
                        _by_object(episodes.iou[rows, full], objects))
    columns = min(len(tables.growth), int(full.max()))
    short = episodes.expected[:, :columns] + np.array(tables.growth)[:columns] < target
    lost = (short & (np.arange(columns) < full[:, None])).any(axis=1)
    reached = np.nanmax(episodes.iou, axis=1) >= target
    return {'episodes': len(at), 'stopped': len(ious),
            'kept': float((ious >= target).mean()) if len(ious) else None,
            'kept_at_least': kept_at_least(int((sure >= target).sum()), len(sure))
            if len(sure) else None,
            'views': float(ends.mean() + 1), 'change': [change.mean, change.low, change.high],
            'given_up': float(lost.mean()),
            'wrongly': float(reached[lost].mean()) if lost.any() else None}
