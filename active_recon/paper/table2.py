"""Table 2: IoU on motorbikes for seven pairs of loss weights; the trained weights do not ship."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from active_recon.config import LossConfig
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import DataError
from active_recon.evaluation.statistics import Interval, mean_interval, Values
from active_recon.paper import published
from active_recon.paper.claims import best, larger
from active_recon.paper.measured import measure
from active_recon.paper.plotting import bars, canvas, drawn, Picture
from active_recon.paper.results import Claim, Column, Result, Table
from active_recon.paper.study import Objects, Study
from active_recon.paper.systems import MODEL, System, training_of
from active_recon.paper.trainings import train_all
from active_recon.paper.writing import provenance
from active_recon.shapes import generators_hash
import numpy as np

CATEGORY = 'motorbike'
COUNTS = {'train': 200, 'val': 30, 'test': 60}
SHARE = 0.2
"""Training views of each of the seven, relative to those of a compared system."""
_SEEDS = {'train': 7_000_000, 'val': 8_000_000, 'test': 9_000_000}  # used by no other dataset
_PAPERS_PAIR = (0.4, 0.6)


def objects(study: Study) -> dict[str, Objects]:
    """Return the sets of motorbikes; make those that are missing."""
    # Other generators make other objects, so the folder's name contains their hash
    root = study.models / 'table2' / f'{CATEGORY}-{generators_hash()[:12]}'
    jobs = [job for part, count in COUNTS.items()
            for job in shape_jobs(CATEGORY, range(_SEEDS[part], _SEEDS[part] + count),
                                  root.absolute() / part)]  # workers begin elsewhere
    if not all(job.folder.complete for job in jobs):
        with study.progress(f'making {CATEGORY}', len(jobs)) as advance:
            for outcome in make_dataset(jobs, workers=study.threads,
                                        crew=study.crew):
                if outcome.refusal:
                    raise DataError(f'{outcome.folder.name}: cannot be made: '
                                    f'{outcome.refusal}')
                advance(1, '')
    return {part: Objects(root / part) for part in COUNTS}


def weights(study: Study) -> dict[tuple[float, float], Path]:
    """Return the weights of every pair, trained on the same motorbikes for the same time."""
    sets = objects(study)
    paths = train_all(study, [training_of(
        System(_name(pair), _name(pair), MODEL, loss=LossConfig(*pair)), [sets['train']],
        sets['val'], sets['val'].root.parent / _folder(pair), round(SHARE * study.samples),
        study.seed) for pair in published.TABLE2])
    return dict(zip(published.TABLE2, paths, strict=True))


def inputs(study: Study) -> dict[str, Any]:
    """Return the inputs of the table, see `provenance`."""
    return provenance(study, objects(study), {
        _name(pair): path for pair, path in weights(study).items()})


def make(study: Study) -> Result:
    """Measure all pairs on training and test objects."""
    sets, trained = objects(study), weights(study)
    values = {part: {pair: measure(study, path, 'random', sets[part]).iou.mean(axis=2)
                     for pair, path in trained.items()} for part in ('train', 'test')}
    spreads = {part: {pair: mean_interval(one) for pair, one in found.items()}
               for part, found in values.items()}
    text = (
        f'Mean IoU over 1 to {study.views} random views of a {CATEGORY}, under seven pairs of the '
        f'weights of volume and silhouette loss. Each of the seven networks saw {SHARE:.0%} of '
        f'the views of a compared system, on the same {COUNTS["train"]} parametric ones and from '
        f'the same seed; `test` are {COUNTS["test"]} others. There is one training for each '
        'pair, so the intervals hold the spread of objects, not that of trainings. These weights '
        'serve this table alone: they do not ship, and no weights that ship know the category.')
    rows = {_name(pair): (spreads['train'][pair], spreads['test'][pair]) for pair in trained}
    return Result(f'Table 2: weights of the two losses, {CATEGORY}', text,
                  [_table(rows)], claims(values['test']), _picture(rows))


def claims(test: Mapping[tuple[float, float], Values]) -> list[Claim]:
    """Return the claims on the mean IoU (N, S) of each pair on the test objects."""
    gaps = {_name(pair): mean_interval(test[_PAPERS_PAIR] - one) for pair, one in test.items()
            if pair != _PAPERS_PAIR}
    silhouettes = np.mean([one for (volume, outline), one in test.items() if outline > volume],
                          axis=0)
    volumes = np.mean([one for (volume, outline), one in test.items() if volume > outline],
                      axis=0)
    return [
        best('lambda_V = 0.4, lambda_S = 0.6 is the best pair', _name(_PAPERS_PAIR), gaps,
             'against the others, test'),
        larger('More weight on the silhouettes is better than more on the volume',
               mean_interval(silhouettes - volumes), 'mean of the pairs with lambda_S > lambda_V '
               'minus those with lambda_V > lambda_S, test'),
    ]


def _name(pair: tuple[float, float]) -> str:
    return f'{pair[0]:g} / {pair[1]:g}'


def _folder(pair: tuple[float, float]) -> str:
    return f'{pair[0]:g}-{pair[1]:g}'


def _table(rows: Mapping[str, tuple[Interval, Interval]]) -> Table:
    theirs = {name: [figures[part] for figures in published.TABLE2.values()]
              for part, name in enumerate(('training', 'test'))}
    own = [Column(name, [row[part] for row in rows.values()])
           for part, name in enumerate(('training', 'test'))]
    return Table('Mean IoU by the weights of the losses', 'lambda_V / lambda_S', list(rows), [
        *own, *(Column(name, cells, published=True, of=published.TABLE2_OF)
                for name, cells in theirs.items())])


def _picture(rows: Mapping[str, tuple[Interval, Interval]]) -> Picture:
    with canvas(7, 3.2) as (figure, axes):
        groups = {name: [row[part] for row in rows.values()]
                  for part, name in enumerate(('training', 'test'))}
        bars(axes[0][0], list(rows), groups, 'mean IoU')
        axes[0][0].set_xlabel('lambda_V / lambda_S')
        return drawn(figure)
