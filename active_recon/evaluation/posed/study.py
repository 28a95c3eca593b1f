"""All results on a set: entrants, their differences, baselines and robustness tests."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from active_recon.datasets.layout import needed_objects
from active_recon.errors import ConfigError
from active_recon.evaluation.posed.choosing import choose
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.measuring import measure, Plan
from active_recon.evaluation.posed.retrieval import Library, nearest_image_scores
from active_recon.evaluation.posed.robustness import disturbances
from active_recon.evaluation.posed.scene import chosen_folders, read_scene, Scene
from active_recon.evaluation.posed.summary import (
    ahead_figures,
    baseline_figures,
    entrant_figures,
    robustness_figures,
)
from active_recon.evaluation.posed.walking import random_orders
from active_recon.reporting import Reporting, silent

_NO_TURNTABLE = ('it takes objects seen from 24 azimuths at an elevation of 30 degrees alone, '
                 'and these are seen from elsewhere')


@dataclass(frozen=True)
class Extent:
    """
    The part of a set that is measured.

    - category: pattern of categories, with `!` before it for all others
    - most: largest number of objects
    - disturbed_views: number of views in the robustness tests, 0 to skip them
    - disturbed_objects: largest number of objects in the robustness tests
    """

    category: str | None = None
    most: int | None = None
    disturbed_views: int = 5
    disturbed_objects: int = 48


def read_set(data: Path, entrants: Sequence[Entrant], extent: Extent, seed: int = 0,
             reporting: Reporting = silent) -> Scene:
    """Read the objects to measure; raises as what finds and reads them does."""
    folders = chosen_folders(needed_objects(data), extent.category, extent.most, seed)
    return read_scene(folders, [entrant.network for entrant in entrants], data.name, reporting)


def choose_on(data: Path, entrants: Sequence[Entrant], plan: Plan, extent: Extent,
              reporting: Reporting = silent) -> list[Entrant]:
    """Return the entrants with thresholds and temperatures chosen on a validation folder."""
    scene = read_set(data, entrants, extent, plan.seed, reporting)
    takers = sum(scene.shown_to(entrant.network) is not None for entrant in entrants)
    with reporting('choosing thresholds', takers * len(scene)) as advance:
        return choose(scene, entrants, plan, str(data), lambda done: advance(done, ''))


def study_set(data: Path, entrants: Sequence[Entrant], plan: Plan, extent: Extent,
              library: Library | None = None, reporting: Reporting = silent) -> dict[str, Any]:
    """
    Return all results on a folder of objects, ready for JSON.

    Entrants that cannot use its views are left out and listed in `left_out`. Raises ConfigError
    where none can.
    """
    scene = read_set(data, entrants, extent, plan.seed, reporting)
    taking = [each for each in entrants if scene.shown_to(each.network) is not None]
    left_out = {each.name: _NO_TURNTABLE for each in entrants if each not in taking}
    if not taking:
        raise ConfigError(f'{data}: no model for these views: expected one that can use them, got '
                          + '; '.join(f'{name}: {why}' for name, why in left_out.items()))
    with reporting(f'measuring {data.name}', len(taking) * len(scene)) as advance:
        measured = measure(scene, taking, plan, lambda done: advance(done, ''))
    first, *others = taking
    figures = {
        'data': str(data), 'category': extent.category, 'objects': len(scene),
        'views': scene.view_count, 'cells': sorted(scene.truths, reverse=True),
        'counts': list(plan.within(scene.view_count)),
        'unreadable': list(scene.views.unreadable), 'left_out': left_out,
        'models': {each.name: entrant_figures(each, measured[each.name]) for each in taking},
        'ahead': {other.name: ahead_figures(measured[first.name], measured[other.name])
                  for other in others}}
    if library is not None:
        starts = random_orders(len(scene), scene.view_count, plan.seed)[:, 0]
        figures['baselines'] = {
            'nearest training image': baseline_figures(
                nearest_image_scores(library, scene, starts))}
    if extent.disturbed_views:
        figures['robustness'] = _disturbed(scene, taking, plan, extent, data.name, reporting)
    return figures


def _disturbed(scene: Scene, entrants: Sequence[Entrant], plan: Plan, extent: Extent, name: str,
               reporting: Reporting) -> dict[str, Any]:
    posed = [each for each in entrants if not each.network.needs_front]
    count = min(extent.disturbed_objects, len(scene))
    with reporting(f'disturbing {name}', len(posed) * count) as advance:
        return {each.name: robustness_figures(disturbances(
            scene, each, plan, extent.disturbed_views, count, lambda done: advance(done, '')))
            for each in posed}
