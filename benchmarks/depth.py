"""
What depth images add: IoU after 1, 3 and 5 random views, with simulated depth and by colour alone.

    python -m benchmarks.depth DATASET --out docs/results/depth.json

The dataset has depth images without noise (`active-recon render ... --depth`). A camera with
faults of its own, drawn by the object's place in the set, measures each object: a scale wrong by
up to 1 %, steps, noise, holes at edges and on shiny and grazing surfaces, flying pixels; nothing
is measured behind the object. Images are on white. The threshold is that of the weights.
`share_above_lower_bound`: how often the IoU is at least the quality's lower bound, which was
fitted without depth; `view_ms`: the median time of a view, in turns, on one thread. A line of
`of_objects` has an object and its IoU by colour alone and with depth, after each count.
"""

import argparse
import json
from pathlib import Path
import shlex
import sys
import time
from typing import Any

from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.models.weights_files import depth_path, find_weights, weights_hash
from active_recon.reconstructor import Reconstructor
from active_recon.simulation.depth_camera import draw_depth_faults, measured_depth
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.rendering import composite
from active_recon.volumes.voxels import iou
import numpy as np

COUNTS = (1, 3, 5)
"""Numbers of views after which it is measured."""
WAYS = ('color', 'depth')


def main() -> None:
    """Measure, write JSON, and print the means."""
    parser = argparse.ArgumentParser(description='What depth images add.')
    parser.add_argument('dataset', type=Path, help="folder of a dataset in R2N2's layout")
    parser.add_argument('--objects', type=int, default=400, help='at most so many, drawn')
    parser.add_argument('--model', default=None, help='weights; default: those that ship')
    parser.add_argument('--out', type=Path, default=Path('depth.json'))
    options = parser.parse_args()
    folders = [folder for folder in list_objects(options.dataset) if folder.has_depth]
    if not folders:
        parser.error(f'{options.dataset}: no depth images: expected a dataset made with --depth')
    weights = find_weights(options.model)
    # One after the other, so that neither knows of the other
    ways = {way: Reconstructor.load(weights, threads=1) for way in WAYS}
    found: list[dict[str, Any]] = []
    for index in np.random.default_rng(0).permutation(len(folders))[:options.objects]:
        found.append({'object': f'{folders[index].category}/{folders[index].name}',
                      **_of_object(folders[index], ways, int(index))})
    table = {way: np.array([each[way] for each in found]) for way in WAYS}
    gain = table['depth'] - table['color']
    options.out.write_text(json.dumps({
        'command': shlex.join(['python', '-m', 'benchmarks.depth', *sys.argv[1:]]),
        'weights_sha256': weights_hash(weights),
        'depth_sha256': weights_hash(depth_path(weights)),
        'objects': len(found), 'counts': COUNTS,
        'iou_64': {way: values.mean(axis=0).round(4).tolist() for way, values in table.items()},
        'gain': gain.mean(axis=0).round(4).tolist(),
        'gain_standard_error': (gain.std(axis=0) / np.sqrt(len(gain))).round(4).tolist(),
        'share_of_objects_that_lose': (gain < 0).mean(axis=0).round(4).tolist(),
        'share_above_lower_bound': {way: np.mean(
            [each['kept'][way] for each in found], axis=0).round(4).tolist() for way in WAYS},
        'view_ms': {way: round(float(np.median([each['ms'][way] for each in found])), 1)
                    for way in WAYS},
        'refused': sum(each['refused'] for each in found),
        'of_objects': [' '.join([each['object'], *(f'{value:.3f}' for way in WAYS
                                                   for value in each[way])])
                       for each in found]}, indent=1) + '\n')
    for way, values in (*table.items(), ('gain', gain)):
        print(way, values.mean(axis=0).round(4))  # noqa: T201


def _of_object(folder: ObjectFolder, ways: dict[str, Reconstructor],
               seed: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, 0])
    cameras, truth = folder.cameras(), folder.voxels(64)
    chosen = rng.permutation(len(cameras))[:max(COUNTS)]
    faults = draw_depth_faults(rng)
    depths = [measured_depth(folder.depth(view) / np.float32(truth.size),
                             cameras[view].intrinsics.fx, faults, rng) for view in chosen]
    said: dict[str, Any] = {'refused': 0, 'kept': {}, 'ms': {}}
    for way, reconstructor in ways.items():
        reconstructor.object_size = truth.size
        reconstructor.reset()
        said[way], said['kept'][way], times = [], [], []
        for number, (view, depth) in enumerate(zip(chosen, depths, strict=True), 1):
            image = composite(folder.image(int(view)), 255)
            begin = time.perf_counter()
            known = reconstructor.add_view(
                image, cameras[view], DepthImage(depth * truth.size) if way == 'depth' else None)
            times.append(1e3 * (time.perf_counter() - begin))
            said['refused'] += bool(known.depth_refusal)
            if number in COUNTS:
                cells = known.grid.occupied(reconstructor.threshold)
                said[way].append(round(float(iou(cells, truth.occupied(0.5))), 4))
                assert known.quality is not None, 'the weights have quality tables'
                said['kept'][way].append(bool(said[way][-1] >= known.quality.lower_bound))
        said['ms'][way] = round(float(np.median(times)), 1)
    return said


if __name__ == '__main__':
    main()
