"""
Saved meshes against the true ones: the surface in narrower cells, and that of the grid's own.

    python -m benchmarks.meshes MANIFEST --split val --objects 40 --out docs/results/meshes.json

Real models are seen on white from random cameras, and reconstructed. After some of the views the
grid in cells half as wide (`refined`) is compared with those that the true mesh touches or
encloses there, beside the grid's cells repeated (`nearest`) and interpolated (`linear`); and the
surface in them with the true mesh, beside that of the grid's own cells (`own`).
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import asdict
import json
from pathlib import Path
import shlex
import sys
import time
from typing import Any

from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.making import Job
from active_recon.datasets.manifest import manifest_jobs, ModelRow, read_manifest
from active_recon.evaluation.statistics import difference, mean_interval
from active_recon.evaluation.surfaces import (
    recall,
    SampledSurface,
    surface_scores,
    thin_cells,
)
from active_recon.models.weights_files import DEFAULT_MODEL, find_weights
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.refinement import refined, refined_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou, VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

COUNTS = (1, 5, 8)
"""Numbers of views after which meshes are compared."""
Scores = Mapping[str, Mapping[str, float]]
"""Values by measure and way."""


def main() -> None:
    """Measure, print a table, and write JSON."""
    options = _options()
    rows = rows_of(options.manifest, options.split)
    drawn = np.random.default_rng(0).choice(
        len(rows), min(options.objects, len(rows)), replace=False)
    jobs = manifest_jobs([rows[index] for index in drawn], Path())
    reconstructor = Reconstructor.load(find_weights(options.model), threads=1)
    found: dict[int, list[Scores]] = {count: [] for count in COUNTS}
    for number, job in enumerate(jobs, 1):
        for count, scores in _measured(job, reconstructor):
            found[count].append(scores)
        views = {count: _summary(scores) for count, scores in found.items()}
        options.out.write_text(json.dumps({  # what is done is kept, should it be broken off
            'command': shlex.join(['python', '-m', 'benchmarks.meshes', *sys.argv[1:]]),
            'model': options.model, 'objects': [_name(job) for job in jobs[:number]],
            'views': views}, indent=1) + '\n')
        print(f'measured {_name(job)}', file=sys.stderr, flush=True)  # noqa: T201
    for count, measures in views.items():
        for measure, said in measures.items():
            print(f'{count} views, {measure}: {_told(said)}')  # noqa: T201


def rows_of(manifest: Path, split: str) -> list[ModelRow]:
    """Return the models of a split; ends in one line where there are none."""
    rows = [row for row in read_manifest(manifest) if row.split == split]
    if not rows:
        sys.exit(f'{manifest}: no model of the split {split!r}: expected one or more; name '
                 'another with --split')
    return rows


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description='Saved meshes against the true ones.')
    parser.add_argument('manifest', type=Path, help='table of real models (CSV)')
    parser.add_argument('--split', default='val')
    parser.add_argument('--objects', type=int, default=40, help='at most so many, drawn')
    parser.add_argument('--model', default=DEFAULT_MODEL, help='a model that ships, or weights')
    parser.add_argument('--out', type=Path, default=Path('meshes.json'))
    return parser.parse_args()


def _name(job: Job) -> str:
    return f'{job.folder.category}/{job.folder.name}'


def _measured(job: Job, reconstructor: Reconstructor) -> Iterator[tuple[int, Scores]]:
    """Yield what is said of an object after each of the counts."""
    mesh = job.make_mesh()
    renderer, surface = Renderer(mesh), SampledSurface(mesh)
    truth = voxelise(mesh, 2 * reconstructor.spec.resolution).occupied(0.5)
    cameras, lights = Viewing('any', max(COUNTS)).of(_name(job))
    thin = thin_cells(truth)
    reconstructor.reset()
    for count, (camera, light) in enumerate(zip(cameras, lights, strict=True), 1):
        image = composite(renderer.render(camera, 2, light), 255)
        known = reconstructor.add_view(image, camera)
        if count in COUNTS:
            yield count, _scores(known.grid, reconstructor.threshold, truth, thin, surface)


def _scores(grid: VoxelGrid, threshold: float, truth: NDArray[np.bool_],
            thin: NDArray[np.bool_], surface: SampledSurface) -> Scores:
    """Return what is said of a grid; `seconds` are those of one thread, per mesh."""
    cells = {'nearest': grid.occupancy.repeat(2, 0).repeat(2, 1).repeat(2, 2),
             'linear': zoom(grid.occupancy, 2, order=1, mode='nearest', grid_mode=True),
             'refined': refined(grid).occupancy}
    scores = {'iou': {way: float(iou(each > threshold, truth)) for way, each in cells.items()},
              'thin_recall': {way: recall(each > threshold, thin)
                              for way, each in cells.items()}}
    for way, make in (('own', grid.mesh), ('refined', lambda at: refined_mesh(grid, at))):
        found = None
        if grid.occupied(threshold).any():
            began = time.process_time()
            mesh = make(threshold)
            scores.setdefault('seconds', {})[way] = time.process_time() - began
            found = SampledSurface(mesh)
        for measure, value in asdict(surface_scores(found, surface)).items():
            scores.setdefault(measure, {})[way] = value
    return scores


def _summary(scores: list[Scores]) -> dict[str, Any]:
    """Return each measure's means, and by how much `refined` is above the others, paired."""
    summary = {}
    for measure, ways in scores[0].items():
        values = {way: np.array([each[measure][way] for each in scores if measure in each])
                  for way in ways}
        there = np.isfinite(values['refined'])  # an object may have no thin parts
        values = {way: each[there] for way, each in values.items()}
        summary[measure] = {
            'mean': {way: asdict(mean_interval(each)) for way, each in values.items()},
            'refined_above': {way: asdict(difference(values['refined'], each))
                              for way, each in values.items() if way != 'refined'}}
    return summary


def _told(said: Mapping[str, Any]) -> str:
    means = ', '.join(f'{way} {value["mean"]:.4f}' for way, value in said['mean'].items())
    ahead = ', '.join(f'{value["mean"]:+.4f} [{value["low"]:.4f}, {value["high"]:.4f}] on {way}'
                      for way, value in said['refined_above'].items())
    return f'{means}; refined {ahead}'


if __name__ == '__main__':
    main()
