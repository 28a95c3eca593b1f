"""Table 5: IoU on categories that were never trained on, at 1, 3 and 5 views."""

from collections.abc import Mapping
from typing import Any

from active_recon.evaluation.statistics import Interval, mean_interval
from active_recon.paper import published
from active_recon.paper.claims import FAILS, HOLDS, larger, reaches
from active_recon.paper.measured import measure, Measured
from active_recon.paper.plotting import bars, canvas, drawn, Picture
from active_recon.paper.results import Claim, Column, counted, Result, Table
from active_recon.paper.spreads import unweighted
from active_recon.paper.study import REAL, Study
from active_recon.paper.writing import provenance
import numpy as np

AIM = 0.45
POLICIES = {'attention': "attention's choice", 'random': 'random views'}
_ALL = 'mean over categories'
_NAMES = {'unseen': 'parametric, unseen categories', **REAL}


def sets(study: Study) -> list[str]:
    """Return the names of the existing folders of unseen categories."""
    return ['unseen', *(name for name in study.real() if name == 'real_unseen')]


def inputs(study: Study) -> dict[str, Any]:
    """Return the inputs of the table, see `provenance`."""
    return provenance(study, {name: study.objects(name) for name in sets(study)},
                      {'measured': study.weights})


def make(study: Study) -> Result:
    """Measure unseen categories with the learned policy and random views."""
    found = {name: {policy: measure(study, study.weights, policy, study.objects(name))
                    for policy in POLICIES} for name in sets(study)}
    views = [view for view in published.TABLE5_VIEWS if view <= study.views]
    text = (
        'IoU after 1, 3 and 5 views of categories that the network was never trained on. '
        'Brackets are 95 % intervals over objects and starts.')
    return Result('Table 5: unseen categories at 1, 3 and 5 views', text,
                  [_table(name, one, views) for name, one in found.items()],
                  [claim for name, one in found.items() for claim in claims(name, one)],
                  _picture(found, views))


def claims(name: str, found: Mapping[str, Measured]) -> list[Claim]:
    """Return the claims on one folder of objects."""
    where, chosen = _NAMES[name], found['attention']
    last = chosen.iou[..., -1]
    results = [
        larger(f'IoU rises with the views ({where})', mean_interval(last - chosen.iou[..., 0]),
               'last minus first view'),
        reaches(f'IoU of {AIM:g} at {chosen.iou.shape[2]} views ({where})',
                unweighted(last, chosen.categories), AIM)]
    means = {str(category): float(last[chosen.categories == category].mean())
             for category in np.unique(chosen.categories)}
    if 'bed' in means:
        lowest = min(means, key=lambda category: means[category])
        results.append(Claim(
            f'Beds are reconstructed the most poorly ({where})',
            HOLDS if lowest == 'bed' else FAILS,
            ', '.join(f'{category} {mean:.3f}' for category, mean in means.items()) + '.'))
    return results


def _table(name: str, found: Mapping[str, Measured], views: list[int]) -> Table:
    categories = found['attention'].categories
    names = [str(category) for category in np.unique(categories)]
    columns = []
    for policy, label in POLICIES.items():
        for view in views:
            values = found[policy].iou[..., view - 1]
            columns.append(Column(f'{view}, {label}', [
                *(mean_interval(values[categories == category]) for category in names),
                unweighted(values, categories)]))
    for index, view in enumerate(published.TABLE5_VIEWS):
        columns.append(Column(str(view), [
            *(published.TABLE5[category][index] if category in published.TABLE5 else None
              for category in names), None], published=True, of=published.TABLE5_OF))
    return Table(f'IoU by the number of views, {_NAMES[name]}', 'category', [*names, _ALL],
                 columns)


def _picture(found: Mapping[str, Mapping[str, Measured]], views: list[int]) -> Picture:
    with canvas(4.5 * len(found), 3.2, columns=len(found)) as (figure, axes):
        for place, (name, one) in zip(axes[0], found.items(), strict=True):
            measured = one['attention']
            names = [str(category) for category in np.unique(measured.categories)]
            groups: dict[str, list[Interval]] = {
                counted(view): [mean_interval(measured.iou[measured.categories == category, :,
                                                      view - 1]) for category in names]
                for view in views}
            bars(place, names, groups, 'IoU')
            place.set_title(_NAMES[name], fontsize=8)
        return drawn(figure)
