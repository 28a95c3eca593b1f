"""
What it costs that the cube is wider than the object, or that the object is not in its middle.

    python -m benchmarks.cube_sizes ../shared/data/meshes --out docs/results/cube-sizes.json

Real models of `val`, on white, from five random cameras, are reconstructed in cubes of several
sides: with the object in the middle, and standing on the cube's floor. The IoU is at 128 cells of
a cube twice as wide as the object, so that no cube is given an advantage. `less` is beside the
cube that fits, with an interval of 95 %. `told` is for how many objects another cube is
told to fit, and `advised_side` its side, relative to the object's longest: the median between
the least and the greatest of the middle 80 %.
"""

import argparse
from collections.abc import Iterator, Mapping
import json
from pathlib import Path
import shlex
import sys
from typing import Any

from active_recon.datasets.manifest import read_manifest
from active_recon.evaluation.statistics import mean_interval
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.models.weights_files import DEFAULT_MODEL, find_weights, weights_hash
from active_recon.photos.cube import Cube
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.better_cube import better_cube
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from benchmarks.studies import with_tables_between_marks
from benchmarks.world_iou import iou_around
import numpy as np
from rich.progress import track

SIDES = (0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
"""Of the cube, relative to the object's longest side."""
PLACES = ('middle', 'floor')
_VIEWS = 5
_UP = np.array([0.0, 0.0, 1.0])
_LENS = Intrinsics(420, 420, 320, 240, 640, 480)  # shows all of the widest cube


def main() -> None:
    """Measure, write JSON, and print the means."""
    parser = argparse.ArgumentParser(description='Cubes wider than the object.')
    parser.add_argument('meshes', type=Path, help='folder of models with a manifest.csv')
    parser.add_argument('--split', default='val', help='of the manifest')
    parser.add_argument('--objects', type=int, default=60, help='at most so many, drawn')
    parser.add_argument('--model', default=DEFAULT_MODEL, help='weights that ship, or a file')
    parser.add_argument('--out', type=Path, default=Path('cube-sizes.json'))
    options = parser.parse_args()
    weights = find_weights(options.model)
    reconstructor = Reconstructor.load(weights, threads=1)
    models = [row for row in read_manifest(options.meshes / 'manifest.csv')
              if row.split == options.split]
    drawn = np.random.default_rng(0).permutation(len(models))[:options.objects]
    found: dict[tuple[str, float], list[tuple[float, float]]] = {}
    for index in track(drawn.tolist(), 'reconstructing'):
        for case, values in _of_model(models[index].file, models[index].front, index,
                                      reconstructor):
            found.setdefault(case, []).append(values)
    options.out.write_text(json.dumps({
        'command': shlex.join(['python', '-m', 'benchmarks.cube_sizes', *sys.argv[1:]]),
        'weights_sha256': weights_hash(weights), 'objects': len(drawn), 'views': _VIEWS,
        'cases': [{'place': place, 'side': side, **_summary(values, found['middle', 1.0])}
                  for (place, side), values in found.items()]}, indent=1) + '\n')
    for (place, side), values in found.items():
        print(place, side, _summary(values, found['middle', 1.0]))  # noqa: T201


def with_table(text: str, result: Mapping[str, Any]) -> str:
    """Return a page with the table between its marks."""
    return with_tables_between_marks(text, {'cube-sizes': lambda: _table(result)})


def _table(result: Mapping[str, Any]) -> Iterator[str]:
    cases = {(case['side'], case['place']): case for case in result['cases']}
    yield ('| side of the cube, in longest sides of the object | in the middle | on the floor | '
           'another told to fit | its side, median [10 %, 90 %] |')
    yield '|---|---|---|---|---|'
    for side in SIDES:
        middle, floor = (cases[side, place] for place in PLACES)
        advised = middle['advised_side']
        fits = '' if advised is None else f'{advised[1]:.2f} [{advised[0]:.2f}, {advised[2]:.2f}]'
        yield (f'| {side:g} | {_told(middle)} | {_told(floor)} | {middle["told"]:.0%}, '
               f'{floor["told"]:.0%} | {fits} |')


def _told(case: Mapping[str, Any]) -> str:
    mean, low, high = case['less']
    beside = f' ({mean:+.3f} [{low:+.3f}, {high:+.3f}])' if mean else ''
    return f'{case["iou"]:.3f}{beside}'


def _of_model(file: Path, front: str, seed: int, reconstructor: Reconstructor
              ) -> Iterator[tuple[tuple[str, float], tuple[float, float]]]:
    """Yield each place and side with the IoU, and the side that is advised, if one is."""
    mesh, rng = load_mesh(file, 'y', front or 'z'), np.random.default_rng(seed)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    mesh.apply_scale(1 / float(mesh.extents.max()))
    renderer = Renderer(mesh)
    cameras = [orbit_camera(rng.uniform(0, 2 * np.pi), rng.uniform(-0.1, 1.2), 2.6, _LENS)
               for _ in range(_VIEWS)]
    images = [composite(renderer.render(camera), 255) for camera in cameras]
    for side in SIDES:
        for place in PLACES:
            above = (side - float(mesh.extents[2])) / 2 if place == 'floor' else 0.0
            cube = Cube(np.array([0.0, 0.0, above]), side, _UP)
            reconstructor.object_size = side
            reconstructor.reset()
            for image, camera in zip(images, cameras, strict=True):
                known = reconstructor.add_view(image, cube.camera(camera, side))
            yield (place, side), _score(known, reconstructor.threshold, cube, mesh)


def _score(known: Reconstruction, threshold: float, cube: Cube, mesh: Any) -> tuple[float, float]:
    found = iou_around(known.grid.occupied(threshold), cube.world_from_object(1.0), mesh)
    better = better_cube(known.grid, threshold, _VIEWS)
    return found, np.nan if better is None else better.side


def _summary(values: list[tuple[float, float]],
             fitting: list[tuple[float, float]]) -> Mapping[str, Any]:
    ious, sides = np.array(values).T
    lost, told = mean_interval(ious - np.array(fitting)[:, 0]), ~np.isnan(sides)
    return {'iou': round(float(ious.mean()), 4),
            'less': [round(value, 4) for value in (lost.mean, lost.low, lost.high)],
            'told': round(float(told.mean()), 3),
            'advised_side': np.quantile(
                sides[told], (0.1, 0.5, 0.9)).round(3).tolist() if told.any() else None}


if __name__ == '__main__':
    main()
