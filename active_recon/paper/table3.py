"""Table 3: single-view IoU of all systems by category; also 1 to 5 views, yaw and cost."""

from collections.abc import Mapping, Sequence
from typing import Any

from active_recon.evaluation.statistics import mean_interval, Values
from active_recon.models.weights_files import read_card
from active_recon.paper import published
from active_recon.paper.claims import all_larger, FAILS, HOLDS, larger, OPEN
from active_recon.paper.comparison import (
    baselines,
    Compared,
    compared,
    cost_table,
    octree_table,
    same_training,
    seen_at_random,
    SHIPPED,
    weights_of,
    yaw_table,
)
from active_recon.paper.measured import Measured
from active_recon.paper.plotting import bars, canvas, curves, drawn, Picture
from active_recon.paper.results import Cell, Claim, Column, plain, Result, Table
from active_recon.paper.spreads import per_view, unweighted
from active_recon.paper.study import REAL, Study
from active_recon.paper.systems import JOINT, TWO_STAGE
from active_recon.paper.writing import provenance
from active_recon.shapes import CATEGORIES
import numpy as np
from numpy.typing import NDArray

UNWEIGHTED, WEIGHTED = 'mean over categories', 'mean over objects'
_OWN = TWO_STAGE.label


def inputs(study: Study) -> dict[str, Any]:
    """Return the inputs of the table, see `provenance`."""
    sets = {name: study.objects(name) for name in (*study.training, 'val', *measured_on(study))}
    return provenance(study, sets, weights_of(compared(study)))


def measured_on(study: Study) -> list[str]:
    """Return the folders on which all systems are measured: those of training categories."""
    return ['test', *(name for name in study.real() if name != 'real_unseen')]


def make(study: Study) -> Result:
    """Measure every system and both baselines on every folder."""
    rows, names = compared(study), measured_on(study)
    found = {name: {row.label: seen_at_random(study, row, name) for row in rows
                    if study.objects(name, resolution=row.resolution).present}
             for name in names}
    plain_answers = baselines(study, names)
    categories = next(iter(found['test'].values())).categories
    single = {label: one.iou[..., 0] for label, one in found['test'].items()}
    tables = [category_table(single | plain_answers['test'], categories)]
    if len(names) > 1:
        tables.append(real_table(found, plain_answers, names[1:]))
    tables += [views_table(found[name], name) for name in names]
    tables += [yaw_table(study, rows), cost_table(study, rows)]
    octree = octree_table(study, rows)
    tables += [octree] if octree else []
    results = [same_training({row.label: read_card(row.weights) for row in rows
                              if row.rival or row.label in (_OWN, JOINT.label)}),
               *claims(rows, found)]
    text = (
        'IoU of a single view on objects that were not trained on, by category. All systems are '
        'measured on the same views; the last tables have their training data. The mean over '
        'categories gives every category the same weight, the mean over objects every object. Two '
        "baselines use no detail of an image: the mean shape of the object's category, which is "
        'given, and the training shape with the nearest image. '
        'A system of 64 cells a side is measured against a truth of 64, where there '
        f'is one, and not compared. {_last_row(rows)}Where the published columns have a mean, it '
        'is ours, of the thirteen printed figures. Brackets are 95 % intervals over '
        'objects and starts. Over several views, all systems see the same random ones.')
    return Result('Table 3: single-view reconstruction by category', text, tables, results,
                  _picture(found['test'], categories), {
                      'iou': {name: {label: [plain(value) for value in per_view(one.iou)]
                                     for label, one in own.items()}
                              for name, own in found.items()}})


def _last_row(rows: Sequence[Compared]) -> str:
    known = {row.label for row in rows}
    return (f'"{SHIPPED}" are those of the package, which may have seen more; they take no part '
            'in the comparison. ' if SHIPPED in known else '')


def claims(rows: Sequence[Compared], found: Mapping[str, Mapping[str, Measured]]) -> list[Claim]:
    """Return the claims on the paired differences to every rival."""
    results: list[Claim] = []
    rivals = [row.label for row in rows if row.rival]
    for name, own in found.items():
        where = REAL.get(name, 'parametric test')
        for rival in rivals:
            gaps = own[_OWN].iou - own[rival].iou
            results.append(all_larger(
                f'2D-3D-attention is ahead of {rival} at every count of views ({where})',
                {f'{view + 1}': mean_interval(gaps[..., view]) for view in range(gaps.shape[2])},
                f'{_OWN} minus {rival} by the number of views'))
    test = found['test']
    results.append(best_categories({label: test[label].iou[..., 0] for label in (_OWN, *rivals)},
                                   test[_OWN].categories))
    results.append(larger(
        'Joint training is ahead of two stages at a single view',
        mean_interval(test[JOINT.label].iou[..., 0] - test[_OWN].iou[..., 0]),
        'joint minus two-stage at one view, parametric test'))
    return results


def best_categories(single: Mapping[str, Values], categories: NDArray[np.str_]) -> Claim:
    """Decide whether the first system has the highest IoU (N, S) in most categories."""
    own, *rivals = single
    names = [str(name) for name in np.unique(categories)]
    means = {label: {name: values[categories == name].mean() for name in names}
             for label, values in single.items()}
    behind = {name: max(rivals, key=lambda rival: means[rival][name]) for name in names
              if rivals and any(means[rival][name] > means[own][name] for rival in rivals)}
    count = len(names) - len(behind)
    because = f'{own} is best in {count} of {len(names)}'
    if behind:
        because += '; ahead of it are ' + ', '.join(
            f'{rival} in {name}' for name, rival in behind.items())
    verdict = HOLDS if 2 * count > len(names) else FAILS if 2 * count < len(names) else OPEN
    return Claim('2D-3D-attention is best in most categories', verdict, f'{because}.')


def category_table(single: Mapping[str, Values], categories: NDArray[np.str_]) -> Table:
    """Return a table of IoU (N, S) by category, with both means and the published values."""
    names = [name for name in CATEGORIES if name in set(categories)]
    names += sorted(set(map(str, categories)) - set(names))
    own = [Column(label, [*(mean_interval(values[categories == name]) for name in names),
                          unweighted(values, categories), mean_interval(values)])
           for label, values in single.items()]
    theirs = []
    for index, label in enumerate(published.TABLE3_SYSTEMS):
        printed = [published.TABLE3[name][index] if name in published.TABLE3 else None
                   for name in names]
        known = [value for value in printed if value is not None]
        whole = len(known) == len(published.TABLE3)
        theirs.append(Column(label, [*printed, float(np.mean(known)) if whole else None, None],
                             published=True))
    return Table('Single-view IoU by category, parametric test', 'category',
                 [*names, UNWEIGHTED, WEIGHTED], own + theirs)


def real_table(found: Mapping[str, Mapping[str, Measured]],
               plain_answers: Mapping[str, Mapping[str, Values]],
               names: Sequence[str]) -> Table:
    """Return a table of single-view IoU on real models; empty where the truth is too coarse."""
    columns = []
    labels = dict.fromkeys(label for name in names for label in found[name])
    for label in (*labels, *plain_answers[names[0]]):
        cells: list[Cell] = []
        for name in names:
            values = (found[name][label].iou[..., 0] if label in found[name]
                      else plain_answers[name].get(label))
            if values is None:  # no true voxels at the resolution of the system
                cells += [None, None]
                continue
            categories = next(iter(found[name].values())).categories
            cells += [unweighted(values, categories), mean_interval(values)]
        columns.append(Column(label, cells))
    return Table('Single-view IoU on real models', 'objects',
                 [f'{REAL[name]}, {mean}' for name in names for mean in (UNWEIGHTED, WEIGHTED)],
                 columns)


def views_table(found: Mapping[str, Measured], name: str) -> Table:
    """Return a table of the IoU of every system after each view."""
    rows = {label: per_view(one.iou) for label, one in found.items()}
    count = len(next(iter(rows.values())))
    return Table(f'IoU at 1 to {count} random views, {REAL.get(name, "parametric test")}',
                 'system', list(rows),
                 [Column(f'{view + 1}', [values[view] for values in rows.values()])
                  for view in range(count)])


def _picture(found: Mapping[str, Measured], categories: NDArray[np.str_]) -> Picture:
    names = [str(name) for name in np.unique(categories)]
    with canvas(12, 6.5, rows=2) as (figure, axes):
        bars(axes[0][0], names, {
            label: [mean_interval(one.iou[categories == name, :, 0]) for name in names]
            for label, one in found.items()}, 'IoU, one view')
        count = next(iter(found.values())).iou.shape[2]
        curves(axes[1][0], range(1, count + 1),
               {label: per_view(one.iou) for label, one in found.items()}, 'views', 'IoU')
        return drawn(figure)
