"""Paired comparison of two models or two policies on the same episodes."""

from collections.abc import Iterator, Mapping, Sequence
import csv
from dataclasses import asdict
from pathlib import Path
from typing import Any

from active_recon.errors import DataError
from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.statistics import by_object, difference
from active_recon.evaluation.trial import Trial
from active_recon.whole_files import whole_file
import numpy as np
from torch import Tensor

COLUMNS = ('model', 'policy', 'seed', 'category', 'object', 'start', 'view', 'azimuth_deg', 'iou',
           'entropy')


def require_same_episodes(one: Trial, other: Trial) -> None:
    """Raise DataError unless two trials have the same objects, starts and numbers of views."""
    own, theirs = (_named(trial) for trial in (one, other))
    if own != theirs or one.count != other.count:
        raise DataError('episodes cannot be paired: expected the same objects, starts and numbers '
                        f'of views for both models, got {len(own)} and {len(theirs)} episodes')


def paired(runs: Sequence[Episodes], others: Sequence[Episodes],
           objects: Tensor) -> dict[str, Any]:
    """
    Return the paired difference of runs minus others, with 95 % intervals, ready for JSON.

    `iou` is that after each view, `auc` that of the area under the curve. Both are the same
    episodes, of `objects` (E,), one run for each seed.
    """
    def of(runs: Sequence[Episodes], view: int | None) -> Any:
        return np.stack([by_object(run.auc if view is None else run.iou[:, view], objects.numpy())
                         for run in runs], axis=2)

    return {'iou': [asdict(difference(of(runs, view), of(others, view)))
                    for view in range(runs[0].iou.shape[1])],
            'auc': asdict(difference(of(runs, None), of(others, None)))}


def write_rows(path: Path, trials: Mapping[str, tuple[Trial, Mapping[str, Sequence[Episodes]]]]
               ) -> None:
    """
    Write a CSV file, whole or not at all: a row for each model, policy, seed, object, start, view.

    `trials` has the trial and the runs of each model by its name. The column `seed` counts the
    runs of a policy from the trial's own on, `start` is the index of the first view in the
    dataset, and `view` counts from 1.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as unfinished, unfinished.open('w', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for model, (trial, runs) in trials.items():
            for policy, seeds in runs.items():
                for seed, run in enumerate(seeds, trial.identity['seed']):
                    writer.writerows([model, policy, seed, *row] for row in _rows(trial, run))


def _rows(trial: Trial, run: Episodes) -> Iterator[list[Any]]:
    for episode, (category, name, start) in enumerate(_named(trial)):
        for view in range(trial.count):
            yield [category, name, start, view + 1,
                   f'{np.degrees(run.azimuths[episode, view]).round(1) % 360:.1f}',
                   f'{run.iou[episode, view]:.6f}', f'{run.entropy[episode, view]:.3f}']


def _named(trial: Trial) -> list[tuple[str, str, int]]:
    """Return the category, the object and the first view of each episode."""
    folders, categories = trial.views.folders, trial.views.categories
    return [(str(categories[index]), folders[index].name, start) for index, start
            in zip(trial.objects.tolist(), trial.starts.tolist(), strict=True)]
