"""
Colours of reconstructed meshes against the true ones, CIEDE2000.

    python -m benchmarks.mesh_colors MANIFEST --split val --objects 20 --views 8 \
        --out docs/results/mesh-colors.json

Models of more than one colour are seen by random cameras of 480 pixels, reconstructed, and the
mesh is coloured from the photographs that are kept. Each corner that a photograph shows is
compared with the colour of the nearest point of the true surface that a camera sees (weighted by
area): as it is (`as_seen`), and after one factor for the whole object (`one_gain`), as no
photograph tells how bright the light is. `true_shape` has the colours put on the true cells' mesh,
so that only the photographs' part is left; `grey` is the true colours' mean for all.
"""

import argparse
from collections.abc import Mapping
import json
from pathlib import Path
import shlex
import sys
from typing import Any

from active_recon.datasets.drawn_cameras import draw_camera
from active_recon.datasets.manifest import manifest_jobs
from active_recon.geometry.cameras import Camera
from active_recon.meshes import coloring
from active_recon.meshes.photos import Photo
from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.refinement import refined_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from benchmarks.meshes import rows_of
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skimage.color import deltaE_ciede2000, rgb2lab
import trimesh

_SIDE = 480
"""Pixels of an image."""
_POINTS = 200_000
"""Drawn on a true surface."""
_VARIED = 8.0
"""Standard deviation of a model's colours, 0 to 255, above which it has more than one."""


def main() -> None:
    """Measure, write JSON, and print the means."""
    options = _options()
    rows = rows_of(options.manifest, options.split)
    order = np.random.default_rng(0).permutation(len(rows))
    jobs = manifest_jobs([rows[index] for index in order], Path())
    weights = find_weights(None)
    reconstructor = Reconstructor.load(weights, threads=1)
    found: list[dict[str, Any]] = []
    for job in jobs:
        if len(found) == options.objects:
            break
        mesh = job.make_mesh()
        truth = _TrueColors(mesh)
        if truth.varied < _VARIED:
            continue
        said = _of_object(mesh, truth, reconstructor, options)
        found.append({'object': f'{job.folder.category}/{job.folder.name}', **said})
        print(found[-1], file=sys.stderr, flush=True)  # noqa: T201
        options.out.write_text(json.dumps({
            'command': shlex.join(['python', '-m', 'benchmarks.mesh_colors', *sys.argv[1:]]),
            'weights_sha256': weights_hash(weights),
            'mean': _means(found), 'objects': found}, indent=1) + '\n')
    if not found:
        sys.exit(f'{options.manifest}: no model of the split {options.split!r} has more than one '
                 'colour: expected one or more; name another with --split')
    print(_means(found))  # noqa: T201


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description='Colours of meshes against the true ones.')
    parser.add_argument('manifest', type=Path, help='table of real models (CSV)')
    parser.add_argument('--split', default='val')
    parser.add_argument('--objects', type=int, default=20, help='at most so many, drawn')
    parser.add_argument('--views', type=int, default=8)
    parser.add_argument('--sides', type=int, nargs='+', default=[256],
                        help='sides of the photographs that are kept, pixels')
    parser.add_argument('--exposure', type=float, default=0.0,
                        help="standard deviation of the logarithm of the images' brightness")
    parser.add_argument('--out', type=Path, default=Path('mesh-colors.json'))
    return parser.parse_args()


class _TrueColors:
    """The colours of a model's surface, where something sees it."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        points, faces = trimesh.sample.sample_surface(mesh, _POINTS, seed=0)[:2]
        self._points = np.asarray(points)
        visual: Any = mesh.visual
        self._colors = np.asarray(visual.face_colors[faces, :3], np.uint8)
        self._scene = EmbreeScene()
        self._geometry = TriangleMesh(self._scene, mesh.triangles.astype(np.float32))
        self.varied = float(self._colors.std(axis=0).max())

    def seen_from(self, cameras: list[Camera]) -> None:
        """Keep the points that a camera sees: nothing is nearer on the way to them."""
        seen = np.zeros(len(self._points), np.bool_)
        for camera in cameras:
            ways = (self._points - camera.position).astype(np.float32)
            eyes = np.tile(camera.position.astype(np.float32), (len(ways), 1))
            seen |= np.asarray(self._scene.run(eyes, ways, query='DISTANCE')) > 0.998
        self._points, self._colors = self._points[seen], self._colors[seen]

    def at(self, points: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the colours of the nearest points of the surface."""
        _, nearest = cKDTree(self._points).query(points)
        return np.asarray(self._colors[nearest])


def _of_object(mesh: trimesh.Trimesh, truth: _TrueColors, reconstructor: Reconstructor,
               options: argparse.Namespace) -> Mapping[str, float]:
    renderer, rng = Renderer(mesh), np.random.default_rng(1)
    reconstructor.reset()
    views = []
    for _ in range(options.views):
        drawn = draw_camera(rng)
        camera = Camera(drawn.pose, drawn.intrinsics.resized(_SIDE, _SIDE))
        image = composite(renderer.render(camera, 2), 255)
        brightness = np.exp(rng.normal(0, options.exposure))
        views.append((np.minimum(image * brightness, 255).astype(np.uint8), camera))
        known = reconstructor.add_view(*views[-1])
    truth.seen_from([camera for _, camera in views])
    shapes = {'': refined_mesh(known.grid, reconstructor.threshold),
              'true_shape ': refined_mesh(voxelise(mesh, 64), 0.5)}
    said = {}
    for side in options.sides:
        coloring_photos = [Photo.of(image, camera, 1.0, side) for image, camera in views]
        for shape, surface in shapes.items():
            found = coloring.surface_colors(surface, coloring_photos)
            if found is not None:
                area = _corner_areas(surface)[found.seen]
                true = truth.at(np.asarray(surface.vertices)[found.seen])
                for way, value in _compared(found.colors[found.seen], true, area).items():
                    said[f'{shape}{side} {way}'] = value
                said[f'{shape}{side} seen'] = float(found.seen.mean())
    return said


def _compared(colors: NDArray[np.uint8], true: NDArray[np.uint8],
              area: NDArray[np.float64]) -> Mapping[str, float]:
    gain = np.median(true.sum(axis=1) + 1.0) / np.median(colors.sum(axis=1) + 1.0)
    mean = np.broadcast_to(np.average(true, axis=0, weights=area), true.shape)
    ways = {'as_seen': colors, 'one_gain': np.minimum(colors * gain, 255), 'grey': mean}
    return {way: float(np.average(deltaE_ciede2000(rgb2lab(each / 255), rgb2lab(true / 255)),
                                  weights=area)) for way, each in ways.items()}


def _corner_areas(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    return np.bincount(mesh.faces.ravel(), np.repeat(mesh.area_faces / 3, 3),
                       len(mesh.vertices))


def _means(found: list[dict[str, Any]]) -> dict[str, float]:
    return {name: round(float(np.mean([each[name] for each in found if name in each])), 3)
            for name in found[0] if name != 'object'}


if __name__ == '__main__':
    main()
