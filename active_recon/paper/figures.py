"""Figures 5, 6, 9 and 10: curves and box plots."""

from collections.abc import Mapping
import hashlib
from typing import Any

from active_recon.evaluation.statistics import Interval, mean_interval, Values
from active_recon.paper import table1
from active_recon.paper.claims import larger
from active_recon.paper.comparison import compared, seen_at_random, weights_of
from active_recon.paper.measured import measure, Measured
from active_recon.paper.plotting import boxes, canvas, curves, drawn
from active_recon.paper.results import Claim, Column, counted, Result, Table
from active_recon.paper.spreads import per_view
from active_recon.paper.study import Study
from active_recon.paper.timing import over_runs, timed_runs
from active_recon.paper.writing import provenance, read_result
import numpy as np

ENTROPY_CATEGORY = 'table'
_POLICIES = ('attention', 'random')


def inputs5(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 5, those of table 1; see `provenance`."""
    found = (study.out / 'table1.json').read_bytes()
    inputs: dict[str, Any] = read_result(study, 'table1')['inputs']
    return inputs | {'table1': hashlib.sha256(found).hexdigest()}


def make5(study: Study) -> Result:
    """Draw loss and IoU over the number of views."""
    figures = read_result(study, 'table1')['figures']
    with canvas(9, 3.4, columns=2) as (figure, axes):
        for place, key, label in ((axes[0][0], 'loss', 'loss'), (axes[0][1], 'iou', 'IoU')):
            rows = {row: [Interval(**value) for value in values]
                    for row, values in figures[key].items()}
            curves(place, range(1, len(next(iter(rows.values()))) + 1), rows, 'views', label)
        picture = drawn(figure)
    return Result(f'Figure 5: loss and IoU over the views, {table1.CATEGORY}',
                  f'What [table 1](table1.md) holds for {table1.CATEGORY}, as curves; bands are '
                  '95 % intervals over objects and starts.', (), (), picture)


def inputs6(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 6, see `provenance`."""
    return provenance(study, {'test': study.objects('test')}, weights_of(compared(study)))


def make6(study: Study) -> Result:
    """Draw the spread of every system's single-view IoU over objects."""
    values = {row.label: seen_at_random(study, row, 'test').iou[..., 0].mean(axis=1)
              for row in compared(study)}
    with canvas(8, 3.8) as (figure, axes):
        boxes(axes[0][0], values, 'IoU, one view')
        picture = drawn(figure)
    return Result(
        'Figure 6: single-view IoU of every system',
        'Each object of the parametric test at the mean of its first views: the line is the '
        'median, the white square the mean, the box holds half of the objects.',
        [quartiles(values)], (), picture)


def quartiles(values: Mapping[str, Values]) -> Table:
    """Return mean, median and quartiles over objects of each system's IoU (N,)."""
    shares = {'lower quartile': 25, 'median': 50, 'upper quartile': 75}
    return Table('Single-view IoU over objects', 'system', list(values), [
        Column('mean', [mean_interval(one) for one in values.values()]),
        *(Column(name, [float(np.percentile(one, share)) for one in values.values()])
          for name, share in shares.items())])


def inputs9(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 9, see `provenance`."""
    return provenance(study, {'test': study.objects('test', ENTROPY_CATEGORY)},
                      {'measured': study.weights})


def make9(study: Study) -> Result:
    """Draw both entropies and IoU over the number of views, for attention and random."""
    objects = study.objects('test', ENTROPY_CATEGORY)
    found = {policy: measure(study, study.weights, policy, objects) for policy in _POLICIES}
    kinds = {"the paper's entropy, nats": 'paper_entropy', 'entropy, nats': 'entropy',
             'IoU': 'iou'}
    rows = {label: {policy: per_view(getattr(one, kind)) for policy, one in found.items()}
            for label, kind in kinds.items()}
    with canvas(12, 3.4, columns=3) as (figure, axes):
        for place, (label, lines) in zip(axes[0], rows.items(), strict=True):
            curves(place, range(1, study.views + 1), lines, 'views', label)
        picture = drawn(figure)
    tables = [Table(f'{label}, over the views', 'policy', list(lines), [
        Column(str(view + 1), [values[view] for values in lines.values()])
        for view in range(study.views)], digits=3 if label == 'IoU' else 0)
        for label, lines in rows.items()]
    return Result(
        f'Figure 9: entropy and IoU over the views, {ENTROPY_CATEGORY}',
        "The paper's entropy, -sum p log p, omits the second term, "
        '(1 - p) log(1 - p); the full entropy is shown too. Both policies start from the same '
        'views, on one frozen network. Bands are 95 % intervals over objects and starts.',
        tables, claims9(found), picture)


def claims9(found: Mapping[str, Measured]) -> list[Claim]:
    """Return the claims that entropy falls and IoU rises more with attention than at random."""
    chosen, random = (found[policy] for policy in _POLICIES)
    results = [larger(
        f'{label} falls more under attention than at random',
        mean_interval(getattr(random, kind)[..., -1] - getattr(chosen, kind)[..., -1]),
        'at random minus under attention after the last view, nats')
        for label, kind in (("The paper's entropy", 'paper_entropy'), ('Entropy', 'entropy'))]
    return [*results, larger('IoU is higher under attention than at random',
                             mean_interval(chosen.iou[..., -1] - random.iou[..., -1]),
                             'attention minus random after the last view')]


def inputs10(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 10, see `provenance`."""
    return provenance(study, {'test': study.objects('test')}, {'measured': study.weights},
                      threads=study.threads)


def make10(study: Study) -> Result:
    """Draw the time of prediction over the number of images."""
    runs = np.cumsum([run['predictions'] for run in timed_runs(study)], axis=1)  # (runs, T)
    lines = [over_runs(list(values)) for values in runs.T]
    with canvas(5.5, 3.2) as (figure, axes):
        curves(axes[0][0], range(1, len(lines) + 1), {'making prediction': lines}, 'views',
               'seconds')
        axes[0][0].set_ylim(bottom=0)
        picture = drawn(figure)
    return Result(
        'Figure 10: time of prediction over the views',
        f'Seconds of predicting from 1 to {len(lines)} images, on '
        f'{counted(study.threads, "CPU thread")}, the mean of {len(runs)} fresh processes; the '
        'first prediction of a process is its slowest. Bands are 95 % intervals over processes.',
        [Table('Seconds of all predictions so far', 'views',
               [str(view + 1) for view in range(len(lines))], [Column('seconds', lines)],
               digits=4)], claims10(runs), picture)


def claims10(runs: Values) -> list[Claim]:
    """Return the claims on the growth of time, from cumulative seconds (runs, T)."""
    share = (runs[:, -1] - runs[:, 0]) / runs[:, 0] / max(runs.shape[1] - 1, 1)
    return [
        larger('The time of prediction rises with the number of images',
               over_runs(list(runs[:, -1] - runs[:, 0])), 'all views minus one, seconds'),
        larger('An additional image costs less than the first',
               over_runs(list(1 - share)), "one minus a further image's share of the first's "
               'time')]
