"""The best three views of an object, out of every sequence of three."""

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
    """Return so many objects (fewer where there are no more), as evenly of each as they go."""
    order = np.random.default_rng(seed).permutation(len(categories))
    rank = np.empty(len(categories), np.int64)  # of each object among those of its category
    for name in np.unique(categories):
        alike = order[categories[order] == name]
        rank[alike] = np.arange(len(alike))
    return np.sort(order[np.argsort(rank[order], kind='stable')][:count])


def best_subsets(trial: Trial, runs: Mapping[str, Sequence[Episodes]], count: int,
                 progress: Callable[[], None] = lambda: None) -> dict[str, Any]:
    """
    Try every ordered sequence of three views of `count` objects; return what is ready for JSON.

    IoU after the third view, on these objects alone:

    - best: of the best sequence; the order counts, since a network may care for it
    - best_from_start: of the best one that begins with the first view of the trial's episodes
    - expected_at_random: the mean of all that begin with it
    - policies: what the policies reached; oracle_lacks: by how much the greedy oracle falls short
      of best_from_start, paired

    Every object is 12,720 passes at 24 views; what was tried before is read from the cache.
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
