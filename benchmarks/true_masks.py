"""
The default network beside the visual hull of masks without error, which no robot has.

    python -m benchmarks.true_masks DATASET --validation VALIDATION --out true-masks.json

The masks are the renderer's own alpha. A cell is kept where the lowest alpha over the views,
sampled at its centre, is above a threshold, which is chosen for each number of views on
validation objects. The network sees the same random views on white, and no mask. IoU at 64 and 32
cells, with 95 % intervals over objects; `ahead` is the network's less the hull's, paired.
"""

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
import shlex
import sys
from typing import Any

from active_recon.datasets.layout import list_objects
from active_recon.datasets.views import read_views, ViewSet
from active_recon.evaluation.statistics import mean_interval
from active_recon.models.lifted import projected, projection, sampled
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import DEFAULT_MODEL, find_weights, weights_hash
from active_recon.volumes.voxels import iou
import numpy as np
from rich.progress import track
import torch
from torch import Tensor
from torch.nn import functional

COUNTS = (1, 2, 3, 5, 8, 12, 24)
THRESHOLDS = (0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
SIDES = (64, 32)


@torch.inference_mode()
def main() -> None:
    """Measure, write JSON, and print the means."""
    parser = argparse.ArgumentParser(description='The hull of masks without error.')
    parser.add_argument('dataset', type=Path, help="folder of a dataset in R2N2's layout")
    parser.add_argument('--validation', type=Path, required=True)
    parser.add_argument('--objects', type=int, default=104, help='at most so many, drawn')
    parser.add_argument('--model', default=DEFAULT_MODEL)
    parser.add_argument('--out', type=Path, default=Path('true-masks.json'))
    options = parser.parse_args()
    torch.set_num_threads(1)
    weights = find_weights(options.model)
    bundle = load_weights(weights)
    validation = np.stack([hulls for hulls, _ in _measured(options.validation, options.objects)])
    best = validation.mean(axis=0).argmax(axis=-1)  # (counts, sides)
    found = list(_measured(options.dataset, options.objects, bundle.reconstruction,
                           bundle.threshold))
    hull = np.stack([np.take_along_axis(each, best[..., None], -1)[..., 0] for each, _ in found])
    network = np.stack([each for _, each in found])
    result: dict[str, Any] = {
        'command': shlex.join(['python', '-m', 'benchmarks.true_masks', *sys.argv[1:]]),
        'weights_sha256': weights_hash(weights), 'objects': len(found), 'counts': COUNTS}
    for place, side in enumerate(SIDES):
        result[str(side)] = {
            name: [vars(mean_interval(values[:, row, place])) for row in range(len(COUNTS))]
            for name, values in (('network', network), ('hull', hull), ('ahead', network - hull))}
        result[str(side)]['thresholds'] = [THRESHOLDS[row] for row in best[:, place]]
        for name in ('network', 'hull', 'ahead'):
            means = [f'{each["mean"]:.3f}' for each in result[str(side)][name]]
            print(f'{side} cells, {name} after {COUNTS} views: {", ".join(means)}')  # noqa: T201
    options.out.write_text(json.dumps(result, indent=1) + '\n')


def _measured(root: Path, most: int, network: ReconstructionNetwork | None = None,
              threshold: float = 0.0) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield an object's IoUs: hulls (counts, sides, thresholds), and the network's (.., sides)."""
    folders = list_objects(root)
    rng = np.random.default_rng(0)
    drawn = np.sort(rng.permutation(len(folders))[:most])
    views = read_views([folders[index] for index in drawn], resolution=64, image_size=128,
                       framed=True)
    for index in track(range(len(views)), f'{root}', transient=True):
        order = rng.permutation(views.images.shape[1])
        hulls, own = [], []
        for row, least in enumerate(_hulls(views, index, order), 1):
            if row in COUNTS:
                hulls.append([[_iou(least, views.voxels[index], side, level)
                               for level in THRESHOLDS] for side in SIDES])
        if network is not None:
            state = network.initial_state(1)
            at = torch.tensor([index])
            for row, view in enumerate(order[:max(COUNTS)], 1):
                view = torch.tensor([int(view)])
                state = network.step(views.white(at, view), views.cameras(at, view), state)
                if row in COUNTS:
                    found = network.decode(state)[0].sigmoid()
                    own.append([_iou(found, views.voxels[index], side, threshold)
                                for side in SIDES])
        yield np.array(hulls), np.array(own)


def _hulls(views: ViewSet, index: int, order: np.ndarray) -> Iterator[Tensor]:
    """Yield the lowest alpha at each cell's projection after each view, (64, 64, 64)."""
    least = torch.ones(64, 64, 64)
    for view in order[:max(COUNTS)]:
        alpha = views.images[index, int(view), ..., 3].float()[None, None] / 255
        camera = views.cameras(torch.tensor([index]), torch.tensor([int(view)]))
        where, _ = projected(projection(camera, 128), 64)
        # Outside its image a camera says nothing
        least = torch.minimum(least, 1 + sampled(alpha - 1, where).reshape(least.shape))
        yield least


def _iou(cells: Tensor, truth: Tensor, side: int, threshold: float) -> float:
    block = 64 // side
    pooled, true = (functional.max_pool3d(each.float()[None], block)[0]
                    for each in (cells, truth))
    return float(iou(pooled[None] > threshold, true[None] > 0)[0])


if __name__ == '__main__':
    main()
