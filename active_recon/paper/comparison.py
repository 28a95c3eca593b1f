"""Measurements of all compared systems on the same objects and views, for table 3 and figure 6."""

from collections.abc import Mapping
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.ablations import iou_by_yaw
from active_recon.evaluation.baselines import Baselines
from active_recon.evaluation.metrics import episodes
from active_recon.evaluation.statistics import Interval, Values
from active_recon.models.network import Cameras
from active_recon.models.ogn import octree_report, Ogn
from active_recon.models.registry import network_entry
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import find_weights, PAPER_MODEL, read_card, weights_hash
from active_recon.paper.claims import FAILS, HOLDS
from active_recon.paper.measured import measure, Measured
from active_recon.paper.results import Claim, Column, Table
from active_recon.paper.study import Study
from active_recon.paper.systems import have_systems, MODEL, systems
from active_recon.paper.trainings import views_seen
from active_recon.volumes.voxels import RESOLUTION
import torch
from torch.utils.flop_counter import FlopCounterMode

SHIPPED = 'the weights that ship'


@dataclass(frozen=True)
class Compared:
    """
    A system to measure: its label, its weights, and its resolution in cells a side.

    The paper's network is compared with each `rival`.
    """

    label: str
    weights: Path
    resolution: int = RESOLUTION
    rival: bool = False


def compared(study: Study) -> list[Compared]:
    """
    Return all systems, training missing ones, and the study's own model as the last row.

    That model may have been trained on more views than the others, so it has a separate label and
    is not part of the claims.
    """
    trained = have_systems(study, systems(study))
    rows = [Compared(system.label, weights, system.resolution,
                     system.model != MODEL and system.resolution == RESOLUTION)
            for system, weights in trained.items()]
    own = find_weights(study.model or PAPER_MODEL)
    if own.is_file() and weights_hash(own) not in {weights_hash(row.weights) for row in rows}:
        rows.append(Compared(SHIPPED if study.model is None else f'`{study.model}`', own))
    return rows


def same_training(cards: Mapping[str, Mapping[str, Any]]) -> Claim:
    """Decide by their cards whether all systems had the same training objects and view counts."""
    seen = {label: views for label, card in cards.items() if (views := views_seen(card))}
    sources = {label: card.get('data') for label, card in cards.items()}
    same = len({json.dumps(source, sort_keys=True) for source in sources.values()}) == 1
    about_equal = bool(seen) and max(seen.values()) <= 1.1 * min(seen.values())
    counts = ', '.join(f'{label} {views:,}' for label, views in seen.items()) or 'unknown'
    objects = 'the same' if same else 'not the same: ' + '; '.join(
        f'{label} {_counted(source)}' for label, source in sources.items())
    return Claim('All systems learned from the same objects and saw about as many views',
                 HOLDS if same and about_equal else FAILS,
                 f'Views seen: {counts}. Objects: {objects}.')


def _counted(source: Mapping[str, int] | None) -> str:
    return ', '.join(f'{count} of {root}' for root, count in (source or {}).items()) or 'unknown'


def weights_of(rows: list[Compared]) -> dict[str, Path]:
    """Return the weights by label."""
    return {row.label: row.weights for row in rows}


def seen_at_random(study: Study, row: Compared, name: str, category: str = '') -> Measured:
    """Measure a system on a folder of the data, with the same random views for all systems."""
    return measure(study, row.weights, 'random', study.objects(name, category, row.resolution))


def baselines(study: Study, names: list[str]) -> dict[str, dict[str, Values]]:
    """
    Return the single-view IoU of both `Baselines` on folders of the data, (N, S) each.

    The mean shape does not depend on the view, so it is the same for all starts.
    """
    baseline = Baselines.of(study.read(*study.training_sets()), study.read(study.objects('val')))
    found: dict[str, dict[str, Values]] = {}
    for name in names:
        views = study.read(study.objects(name))
        items, starts = episodes(views, study.starts, study.seed)
        shape = baseline.mean_shape(views)
        with study.progress(f'nearest image, {name}', 1) as advance:
            nearest = baseline.nearest_image(views, items, starts)
            advance(1, '')
        found[name] = {
            'mean shape (told the category)': shape[:, None].repeat(study.starts, axis=1),
            'nearest training image': nearest.reshape(len(views), study.starts)}
    return found


def yaw_table(study: Study, rows: list[Compared]) -> Table:
    """Return a table of every system's single-view IoU with wrong yaws of the front, on test."""
    found: dict[str, dict[str, Interval]] = {}
    for row in rows:
        bundle = load_weights(row.weights, study.device)
        views = study.read(study.objects('test', resolution=row.resolution))
        with study.progress(f'yaw, {row.label}', 1) as advance:
            by_yaw = iou_by_yaw(bundle.reconstruction, views, *episodes(views, 1, study.seed),
                                bundle.threshold)
            advance(1, '')
        found[row.label] = {f'{yaw} deg': Interval(**value) for yaw, value in by_yaw.items()}
    yaws = list(next(iter(found.values())))
    return Table("Single-view IoU where the object's front stands turned, test", 'system',
                 list(found), [Column(yaw, [by_yaw[yaw] for by_yaw in found.values()])
                               for yaw in yaws])


def cost_table(study: Study, rows: list[Compared]) -> Table:
    """Return a table of every system's size, cost per view, and number of training views."""
    costs: dict[str, list[Any]] = {}
    for row in rows:
        bundle, card = load_weights(row.weights), read_card(row.weights)
        is_fitted = network_entry(bundle.model).fit is not None
        parameters = sum(part.numel() for part in bundle.reconstruction.parameters())
        costs[row.label] = [
            parameters or None, _million_operations(study, row),
            'fitted' if is_fitted else views_seen(card),
            row.resolution, f'{bundle.threshold:.2f}', weights_hash(row.weights)[:12]]
    headings = ('parameters', 'multiply-adds a view, million', 'views seen in training',
                'cells a side', 'threshold', 'weights')
    return Table('The systems', 'system', list(costs), [
        Column(heading, [cost[index] for cost in costs.values()])
        for index, heading in enumerate(headings)], digits=0)


def _million_operations(study: Study, row: Compared) -> float | None:
    """Return the multiply-adds of one view, in millions; None for systems that fit at run time."""
    bundle = load_weights(row.weights)
    if network_entry(bundle.model).fit is not None:
        return None
    images, cameras = _first_views(study.read(study.objects('test', resolution=row.resolution)),
                                    1)
    with torch.no_grad(), FlopCounterMode(display=False) as counter:
        bundle.reconstruction(images, cameras, bundle.reconstruction.initial_state(len(images)))
    return float(counter.get_total_flops() / 2e6)


def octree_table(study: Study, rows: list[Compared]) -> Table | None:
    """Return cells and memory of the finest octree decoder and a dense one; None without OGN."""
    trees = [row for row in rows if isinstance(load_weights(row.weights).reconstruction, Ogn)]
    if not trees:
        return None
    row = max(trees, key=lambda tree: tree.resolution)
    network = load_weights(row.weights).reconstruction
    assert isinstance(network, Ogn)
    images, cameras = _first_views(study.read(study.objects('test', resolution=row.resolution)),
                                    64)
    with torch.no_grad():
        report = octree_report(network, network.encode(images, cameras))
    sides = list(report['cells'])
    headings = {'cells': 'cells', 'dense_cells': 'cells, dense', 'bytes': 'kB of features',
                'dense_bytes': 'kB of features, dense'}
    units = {key: 1024 if key.endswith('bytes') else 1 for key in headings}
    return Table(
        f'{row.label}: what the octree holds per object, beside a dense decoder of its widths',
        'cells a side', [*map(str, sides), 'all levels'],
        [Column(heading, [*(report[key][side] / units[key] for side in sides),
                          sum(report[key].values()) / units[key]])
         for key, heading in headings.items()], digits=0)


def _first_views(views: ViewSet, count: int) -> tuple[torch.Tensor, Cameras]:
    items = torch.arange(min(count, len(views)))
    first = torch.zeros_like(items)
    return views.white(items, first), views.cameras(items, first)
