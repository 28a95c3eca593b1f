"""Figures 7, 8 and 11: example reconstructions, drawn as voxels."""

from collections.abc import Sequence
import hashlib
import math
from pathlib import Path
from typing import Any

from active_recon.datasets.pascal3d import list_photographs
from active_recon.datasets.photographs import read_photographs
from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.evaluation.metrics import episodes
from active_recon.evaluation.rollouts import roll_out, Step
from active_recon.evaluation.statistics import mean_interval, Values
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, orbit_camera
from active_recon.models.weights import Bundle, load_weights
from active_recon.paper.plotting import Picture, tiles
from active_recon.paper.results import Column, counted, Result, Table
from active_recon.paper.study import Study
from active_recon.paper.systems import have_systems, R2N2, SHAPE_BASIS, TWO_STAGE
from active_recon.paper.table5 import sets as unseen_sets
from active_recon.paper.writing import provenance
from active_recon.policies import load_policy, PolicyOptions
from active_recon.volumes.boxes import height_range, voxel_picture
from active_recon.volumes.voxels import iou, VoxelGrid
import numpy as np
from numpy.typing import NDArray
import torch

_TILE = 150
_BATCH = 32
MULTI_VIEW = ('table', 'speaker', 'chair', 'lamp', 'bench', 'airplane')
_EXAMPLES = 6


def inputs7(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 7, see `provenance`."""
    found = have_systems(study, (TWO_STAGE, SHAPE_BASIS))
    sets = {} if study.pascal3d else {'examples': study.objects(_stand_in(study))}
    return provenance(study, sets, {system.label: path for system, path in found.items()},
                      pascal3d=study.pascal3d and _annotations(study.pascal3d))


def _annotations(root: Path) -> dict[str, Any]:
    """Return the folder, the number of annotated images and the hash of names and sizes."""
    lines = [f'{path.relative_to(root)} {path.stat().st_size}'
            for path in sorted((root / 'Annotations').glob('*/*.mat'))]
    return {'folder': str(root), 'images': len(lines),
            'sha256': hashlib.sha256('\n'.join(lines).encode()).hexdigest()}


def make7(study: Study) -> Result:
    """Draw single-view examples of our network and the shape basis."""
    bundles = {system.label: load_weights(path) for system, path in have_systems(
        study, (TWO_STAGE, SHAPE_BASIS)).items()}
    views, where = _photographs(study) if study.pascal3d else _renderings(study)
    items = torch.arange(len(views))
    found = {label: _single_view(bundle, views) for label, bundle in bundles.items()}
    chosen = _first_of_each(views)[:_EXAMPLES]
    rows, notes = [], []
    for item in chosen:
        truth = views.voxels[item].numpy()
        predicted = [found[label][0][item] for label in bundles]
        rows.append([_image(views, item, 0), *_voxel_tiles(truth, [truth, *predicted])])
        notes.append(['', '', *(f'IoU {found[label][1][item]:.2f}' for label in bundles)])
    picture = tiles(rows, ['image', 'truth', *bundles],
                    [str(views.categories[item]) for item in chosen], notes)
    table = Table('Single-view IoU over all of them', 'system', list(bundles), [
        Column(f'IoU ({len(items)} objects)',
               [mean_interval(found[label][1]) for label in bundles])])
    return Result(
        'Figure 7: single-view examples beside the shape basis', f'{where} Neither system was '
        'trained or fine-tuned on them. The shape basis (Kar et al. 2015) is fitted to the same '
        'training objects. Shown is the first object of each category.', [table], (), picture)


def _photographs(study: Study) -> tuple[ViewSet, str]:
    assert study.pascal3d is not None
    photographs, left_out = list_photographs(study.pascal3d)
    with study.progress('reading photographs', len(photographs)) as advance:
        views = read_photographs(photographs, left_out, lambda: advance(1, ''))
    return views, (f'Photographs of PASCAL3D+ ({len(views)}; {len(views.unreadable)} left out), '
                   'the truth being the CAD model that the annotation names.')


def _stand_in(study: Study) -> str:
    return 'real_cc0' if study.objects('real_cc0').present else 'test'


def _renderings(study: Study) -> tuple[ViewSet, str]:
    name = _stand_in(study)
    what = 'real CC0 models' if name == 'real_cc0' else 'parametric test objects'
    return study.read(study.objects(name)), (
        'The paper shows PASCAL3D+, whose folder was not given (`--pascal3d`); these are renders '
        f'of {what} instead.')


@torch.inference_mode()
def _single_view(bundle: Bundle, views: ViewSet) -> tuple[list[NDArray[np.bool_]], Values]:
    """Return the prediction from each object's first image, (R, R, R), and its IoU, (N,)."""
    predicted: list[NDArray[np.bool_]] = []
    for low in range(0, len(views), _BATCH):
        items = torch.arange(low, min(low + _BATCH, len(views)))
        first = torch.zeros_like(items)
        logits, _ = bundle.reconstruction(
            views.white(items, first), views.cameras(items, first),
            bundle.reconstruction.initial_state(len(items)))
        predicted += list((logits.sigmoid() > bundle.threshold).numpy())
    return predicted, np.asarray(iou(np.stack(predicted), views.voxels.numpy()), np.float64)


def inputs8(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 8, see `provenance`."""
    found = have_systems(study, (TWO_STAGE, R2N2))
    return provenance(study, {'test': study.objects('test')},
                      {system.label: path for system, path in found.items()})


def make8(study: Study) -> Result:
    """Draw reconstructions from views chosen by attention, and of 3D-R2N2 from random views."""
    found = have_systems(study, (TWO_STAGE, R2N2))
    views = study.read(study.objects('test'))
    chosen = _first_of_each(views, MULTI_VIEW)
    ours = _steps(study, found[TWO_STAGE], 'attention', views, chosen)
    theirs = _steps(study, found[R2N2], 'random', views, chosen)
    rows, notes = [], []
    for row, item in enumerate(chosen):
        truth = views.voxels[item].numpy()
        predicted = [_occupied(steps, row, path) for steps, path in (
            (ours, found[TWO_STAGE]), (theirs, found[R2N2]))]
        taken = [_nearest_image(views, item, at) for at in ours[-1].taken[row]]
        rows.append([*taken, *_voxel_tiles(truth, [truth, *predicted])])
        notes.append([*(f'{math.degrees(at):.0f}°' for at in ours[-1].taken[row]), '',
                      *(f'IoU {iou(one, truth):.2f}' for one in predicted)])
    headings = [*(f'view {view + 1}' for view in range(study.views)), 'truth', 'ours', '3D-R2N2']
    return Result(
        'Figure 8: multi-view reconstruction beside 3D-R2N2',
        f'The images are the {study.views} views that the attention policy chose for our '
        'network; 3D-R2N2 was given as many random ones. Shown is the first test object of each '
        'category.', (), (),
        tiles(rows, headings, [str(views.categories[item]) for item in chosen], notes))


def inputs11(study: Study) -> dict[str, Any]:
    """Return the inputs of figure 11, see `provenance`."""
    return provenance(study, {name: study.objects(name) for name in unseen_sets(study)},
                      {'measured': study.weights})


def make11(study: Study) -> Result:
    """Draw unseen categories after 1, 3 and 5 views."""
    rows, names, notes = [], [], []
    shown = [view for view in (1, 3, 5) if view <= study.views]
    for name in unseen_sets(study):
        views = study.read(study.objects(name))
        chosen = _first_of_each(views)
        steps = _steps(study, study.weights, 'attention', views, chosen)
        for row, item in enumerate(chosen):
            truth = views.voxels[item].numpy()
            predicted = [_occupied(steps[:view], row, study.weights) for view in shown]
            rows.append([_nearest_image(views, item, steps[0].taken[row, 0]),
                         *_voxel_tiles(truth, [truth, *predicted])])
            notes.append(['', '', *(f'IoU {iou(one, truth):.2f}' for one in predicted)])
            kind = 'parametric' if name == 'unseen' else 'real'
            names.append(f'{views.categories[item]}\n({kind})')
    headings = ['first image', 'truth', *map(counted, shown)]
    return Result('Figure 11: unseen categories',
                  'The first object of each category that was never trained on, after 1, 3 and '
                  '5 views of the attention policy. [Table 5](table5.md) holds the means.', (), (),
                  tiles(rows, headings, names, notes))


def _first_of_each(views: ViewSet, categories: Sequence[str] | None = None) -> list[int]:
    """Return the index of the first object of each category, by default of all categories."""
    there = [str(name) for name in views.categories]
    wanted = [name for name in categories or dict.fromkeys(there) if name in there]
    if not wanted:
        raise DataError(f'no such objects: expected some of {", ".join(categories or ())}, got '
                        f'{", ".join(dict.fromkeys(there))}')
    return [there.index(name) for name in wanted]


def _steps(study: Study, weights: Path, policy: str, views: ViewSet,
           items: Sequence[int]) -> list[Step]:
    """Return the steps of an episode of each object, from the first of the tables' starts."""
    every, starts = episodes(views, study.starts, study.seed)
    first = starts[[int((every == item).nonzero()[0]) for item in items]]
    options = PolicyOptions(np.random.default_rng(study.seed), study.views, weights)
    return list(roll_out(load_weights(weights).reconstruction, load_policy(policy, options),
                         views, torch.tensor(items), first, study.views))


def _occupied(steps: Sequence[Step], row: int, weights: Path) -> NDArray[np.bool_]:
    occupied: NDArray[np.bool_] = (
        steps[-1].occupancy[row] > load_weights(weights).threshold).numpy()
    return occupied


def _image(views: ViewSet, item: int, view: int) -> Picture:
    image = views.white(torch.tensor([item]), torch.tensor([view]))[0]
    return np.asarray((image * 255).round().byte().permute(1, 2, 0).numpy())


def _nearest_image(views: ViewSet, item: int, azimuth: float) -> Picture:
    return _image(views, item, int((views.azimuths[item] - azimuth).abs().argmin()))


def _voxel_tiles(truth: NDArray[np.bool_], grids: Sequence[NDArray[np.bool_]]) -> list[Picture]:
    """Return renderings of grids as boxes, with the colour scale of the truth's heights."""
    camera = Camera(orbit_camera(math.radians(35), math.radians(25), 1.9).pose,
                    CANONICAL_INTRINSICS.resized(_TILE, _TILE))
    heights = height_range(VoxelGrid(truth.astype(np.float32)))
    return [voxel_picture(VoxelGrid(grid.astype(np.float32)), heights, camera, (255, 255, 255))
            for grid in grids]
