"""
How many meshes are products: closed, oriented, nowhere through themselves, and of how many bodies.

    python -m benchmarks.watertight DATASET --objects 200 --out docs/results/watertight.json

Of each object drawn from a dataset (see `active-recon dataset`) the true cells are made a mesh, as
`save_mesh` does, and of every `--every`th object what the network reconstructs from 1, 5 and 8 of
its views. `bodies` are the parts of a mesh; `true_bodies` those of the true cells
that are joined by faces, edges or corners.
"""

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
import shlex
import sys
from typing import Any

from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.evaluation.self_intersections import self_intersections
from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.refinement import refined_mesh
from active_recon.volumes.rendering import composite
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from scipy.ndimage import label
import trimesh

COUNTS = (1, 5, 8)
"""Numbers of views after which reconstructions are cut."""
THRESHOLD = 0.5
"""Of the true cells."""


def main() -> None:
    """Measure, write JSON, and print the counts."""
    parser = argparse.ArgumentParser(description='How many meshes are closed and so on.')
    parser.add_argument('dataset', type=Path, help="folder of a dataset in R2N2's layout")
    parser.add_argument('--objects', type=int, default=200, help='at most so many, drawn')
    parser.add_argument('--every', type=int, default=5, help='reconstruct every so many-th')
    parser.add_argument('--out', type=Path, default=Path('watertight.json'))
    options = parser.parse_args()
    folders = list_objects(options.dataset)
    drawn = np.random.default_rng(0).permutation(len(folders))[:options.objects]
    weights = find_weights(None)
    reconstructor = Reconstructor.load(weights, threads=1)
    found: dict[str, list[dict[str, Any]]] = {}
    for number, folder in enumerate(folders[index] for index in drawn):
        for way, said in _of_object(folder, reconstructor, number % options.every == 0):
            found.setdefault(way, []).append(said)
        options.out.write_text(json.dumps({
            'command': shlex.join(['python', '-m', 'benchmarks.watertight', *sys.argv[1:]]),
            'weights_sha256': weights_hash(weights),
            'counts': {way: _counts(said) for way, said in found.items()},
            'failed': {way: [each for each in said if not _holds(each)]
                       for way, said in found.items()},
            'objects': [said['object'] for said in found['true cells']]}, indent=1) + '\n')
    for way, said in found.items():
        print(f'{way}: {_counts(said)}')  # noqa: T201


def _of_object(folder: ObjectFolder, reconstructor: Reconstructor,
               seen: bool) -> Iterator[tuple[str, dict[str, Any]]]:
    name = f'{folder.category}/{folder.name}'
    grid = folder.voxels(reconstructor.spec.resolution)
    bodies = int(label(grid.occupied(THRESHOLD), np.ones((3, 3, 3)))[1])
    yield 'true cells', {'object': name, 'true_bodies': bodies,
                         **_said(refined_mesh(grid, THRESHOLD))}
    if not seen:
        return
    reconstructor.reset()
    cameras = folder.cameras()
    order = np.linspace(0, len(cameras), max(COUNTS), endpoint=False).astype(int)
    for count, index in enumerate(order, 1):
        known = reconstructor.add_view(composite(folder.image(index), 255), cameras[index])
        if count in COUNTS and known.grid.occupied(reconstructor.threshold).any():
            yield f'reconstructed, {count} views', {
                'object': name, 'true_bodies': bodies,
                **_said(refined_mesh(VoxelGrid(known.grid.occupancy), reconstructor.threshold))}


def _said(mesh: trimesh.Trimesh) -> dict[str, Any]:
    _, counts = np.unique(np.sort(mesh.edges, axis=1), axis=0, return_counts=True)
    bodies = trimesh.graph.connected_component_labels(
        mesh.face_adjacency, node_count=len(mesh.faces))
    sizes = np.bincount(bodies)
    return {'faces': len(mesh.faces), 'watertight': bool(mesh.is_watertight),
            'edges_of_two_faces': bool((counts == 2).all()),
            'consistent': bool(mesh.is_winding_consistent),
            'volume_above_0': bool(mesh.volume > 0),
            'self_intersections': len(self_intersections(mesh)),
            'bodies': len(sizes), 'largest_share': float(sizes.max() / sizes.sum())}


def _counts(said: list[dict[str, Any]]) -> dict[str, int]:
    """Return of how many meshes each is true."""
    return {'meshes': len(said), 'closed': sum(map(_closed, said)),
            'nowhere through itself': sum(not each['self_intersections'] for each in said),
            'no more bodies than the object': sum(
                each['bodies'] <= each['true_bodies'] for each in said),
            'all three': sum(map(_holds, said))}


def _closed(said: dict[str, Any]) -> bool:
    return bool(said['watertight'] and said['edges_of_two_faces'] and said['consistent']
                and said['volume_above_0'])


def _holds(said: dict[str, Any]) -> bool:
    return (_closed(said) and not said['self_intersections']
            and said['bodies'] <= said['true_bodies'])


if __name__ == '__main__':
    main()
