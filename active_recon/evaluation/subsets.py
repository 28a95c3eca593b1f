"""The best sequence of three views of an object, by exhaustive search."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.oracle import sequence_iou
from active_recon.evaluation.statistics import by_object, difference, mean_interval
from active_recon.evaluation.trial import read_arrays, Trial, write_arrays
import numpy as np
from numpy.typing import NDArray

_LENGTH = 3


def drawn_over_categories(categories: NDArray[np.str_], count: int,
                          seed: int = 0) -> NDArray[np.int64]:
    """Return the indices of `count` objects (or all, if fewer), evenly spread over categories."""
    order = np.random.default_rng(seed).permutation(len(categories))
    rank = np.empty(len(categories), np.int64)  # position of each object within its category
    for name in np.unique(categories):
        alike = order[categories[order] == name]
        rank[alike] = np.arange(len(alike))
    return np.sort(order[np.argsort(rank[order], kind='stable')][:count])


def best_subsets(trial: Trial, runs: Mapping[str, Sequence[Episodes]], count: int,
                 progress: Callable[[], None] = lambda: None) -> dict[str, Any]:
    """
    Measure every ordered sequence of three views of `count` objects; return results for JSON.

    IoU after the third view, on these objects only:

    - best: of the best sequence (a network may depend on the order)
    - best_from_start: of the best sequence that begins with the first view of an episode
    - expected_at_random: the mean over all sequences that begin with it
    - policies: of the policies; oracle_lacks: best_from_start minus the greedy oracle, paired

    An object of 24 views takes 12,720 passes; earlier results are read from the trial's cache.
    """
    items = drawn_over_categories(trial.views.categories, count)
    starts = by_object(trial.starts.numpy(), trial.objects.numpy())[items]
    tables = []
    for item in items:
        tables.append(_table(trial, int(item)))
        progress()
    after = np.stack(tables).astype(np.float64)  # (n, V, V, V)
    rows = np.arange(len(items))[:, None]
    best_from_start = np.nanmax(after, axis=(2, 3))[rows, starts]
    at_random = np.nanmean(after, axis=(2, 3))[rows, starts]
    found: dict[str, Any] = {
        'objects': len(items), 'views': _LENGTH,
        'best': asdict(mean_interval(np.nanmax(after, axis=(1, 2, 3)))),
        'best_from_start': asdict(mean_interval(best_from_start)),
        'expected_at_random': asdict(mean_interval(at_random))}
    if trial.count >= _LENGTH:
        reached = {name: np.stack([
            by_object(run.iou[:, _LENGTH - 1], trial.objects.numpy())[items] for run in seeds], 2)
            for name, seeds in runs.items()}
        found['policies'] = {name: asdict(mean_interval(values))
                             for name, values in reached.items()}
        if 'oracle' in reached:
            found['oracle_lacks'] = asdict(difference(best_from_start, reached['oracle']))
    return found


def _table(trial: Trial, item: int) -> NDArray[np.float32]:
    path = trial.folder and trial.folder / f'sequences-{item:05d}.npz'
    if path and path.is_file():
        return read_arrays(path, {'iou'})['iou'].astype(np.float32)
    table = sequence_iou(trial.network, trial.views, item, trial.threshold, _LENGTH,
                         trial.bfloat16)
    if path:
        write_arrays(path, iou=table)
    return table
