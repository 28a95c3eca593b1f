"""
A network before backgrounds of every kind, with the background removed and without.

    python -m benchmarks.backgrounds data/test data/unseen data/real_val --photographs DINO

Random views of random objects get backgrounds, light, blur and noise as in training, of other
seeds. The network is shown each image as it is, and on white by GrabCut, by the segmenter, by
what the segmenter found in all of the images together (as `reconstruct --background segment`
does), and by the renderer's own alpha. IoU at 32 cells after 1, 3 and 5 views with 95 % intervals
over objects; `gain` is that of each way less that of the image as it is, paired. `silhouette` is
the IoU of the silhouettes, of five views for `together`.

Photographs: IoU with the hull of all their masks after five even views, from the first one on,
and the mean, least and greatest from any. Written are docs/results/backgrounds.json and two
tables in doc/results.md; with another --out, that file alone.
"""

import argparse
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
import json
from multiprocessing import get_context
from pathlib import Path
import shlex
import sys
from typing import Any

from active_recon.datasets.layout import list_objects
from active_recon.datasets.middlebury import read_photographs
from active_recon.datasets.views import read_views, ViewSet
from active_recon.evaluation.posed.photographs import (
    averaged,
    BACKGROUNDS,
    even_views,
    hull,
    with_background,
)
from active_recon.evaluation.statistics import mean_interval
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.models.lifting import Lifting
from active_recon.models.network import Cameras
from active_recon.models.segmenter import Segmenter
from active_recon.models.segmenter_weights import read_segmenter
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import (
    DEFAULT_MODEL,
    find_weights,
    SEGMENTER,
    weights_hash,
)
from active_recon.photos.backgrounds import grabcut
from active_recon.photos.segmented_views import agreed_shares
from active_recon.runtimes.torch import TorchSegmenterRuntime
from active_recon.segmentation import FramedShares, Segmentation
from active_recon.training.posed_batches import draw_posed_batch, PosedBatch
from active_recon.volumes.voxels import iou
from benchmarks.studies import with_tables_between_marks
import numpy as np
from numpy.typing import NDArray
from rich.progress import track
import torch
from torch import Tensor
from torch.nn import functional

KINDS = ('white', 'plain', 'gradient', 'noise', 'clutter', 'pieces', 'tiles', 'black')
WAYS = ('as it is', 'GrabCut', 'segmenter', 'together', 'true mask')
COUNTS = (1, 3, 5)
ROOT = Path(__file__).parents[1]
RESULTS, DOCUMENT = ROOT / 'docs/results/backgrounds.json', ROOT / 'doc/results.md'
_SETS = {'test': 'parametric test', 'unseen': 'unseen categories', 'real_val': 'real models'}
_SEED = 90_000  # of no training: those count from 0


def main() -> None:
    """Measure, and write JSON and the tables."""
    parser = argparse.ArgumentParser(description='The network before backgrounds of every kind.')
    parser.add_argument('data', type=Path, nargs='+', help="datasets in R2N2's layout")
    parser.add_argument('--objects', type=int, default=60, help='drawn from each dataset')
    parser.add_argument('--photographs', type=Path, required=True,
                        help="folder in Middlebury's format")
    parser.add_argument('--workers', type=int, default=2, help='processes')
    parser.add_argument('--segmenter', type=Path, default=SEGMENTER)
    parser.add_argument('--model', default=DEFAULT_MODEL, help='a model that ships, or weights')
    parser.add_argument('--out', type=Path, default=RESULTS)
    options = parser.parse_args()
    weights = find_weights(options.model)
    result: dict[str, Any] = {
        'command': shlex.join(['python', '-m', 'benchmarks.backgrounds', *sys.argv[1:]]),
        'weights_sha256': weights_hash(weights),
        'segmenter_sha256': weights_hash(options.segmenter), 'objects': options.objects,
        'counts': COUNTS, 'sets': {}}
    jobs = [(root, kind) for root in options.data for kind in KINDS]
    with ProcessPoolExecutor(options.workers, get_context('spawn')) as pool:
        photographs = pool.submit(_of_photographs, weights, options.segmenter,
                                  options.photographs)
        found = pool.map(partial(_of_kind, weights, options.segmenter, options.objects), *zip(
            *jobs, strict=True))
        for (root, kind), told in track(zip(jobs, found, strict=True), 'backgrounds', len(jobs)):
            result['sets'].setdefault(str(root), {})[kind] = told
        result['photographs'] = photographs.result()
    options.out.write_text(json.dumps(result, indent=1) + '\n')
    if options.out.resolve() == RESULTS:
        DOCUMENT.write_text(with_table(DOCUMENT.read_text()))


def _of_kind(weights: Path, segmenter: Path, objects: int, root: Path,
             kind: str) -> dict[str, Any]:
    """Return what is told of a set before backgrounds of a kind."""
    network, threshold = _network(weights)
    views = read_views(list_objects(root), resolution=64, image_size=128, framed=True,
                       at_once=False)
    return _told([_measured(network, threshold, read_segmenter(segmenter), views, kind, row)
                  for row in range(objects)])


def _network(weights: Path) -> tuple[Lifting, float]:
    torch.set_num_threads(1)
    bundle = load_weights(weights)
    assert isinstance(bundle.reconstruction, Lifting)
    return bundle.reconstruction, bundle.threshold


def with_table(text: str) -> str:
    """Return the document with the table between its marks."""
    return with_tables_between_marks(text, {'backgrounds': table, 'photographs': photo_table})


def table() -> Iterator[str]:
    """Yield the lines of the table of IoU after the last view before backgrounds of each kind."""
    yield '| objects | background | as it is | GrabCut | true mask | segmenter | together |'
    yield '|---|---|---|---|---|---|---|'
    for root, kinds in json.loads(RESULTS.read_text())['sets'].items():
        for kind, found in kinds.items():
            means = {way: f'{found[way][-1]["mean"]:.3f}' for way in WAYS}
            gains = {way: '{mean:+.3f} [{low:.3f}, {high:.3f}]'.format(**found['gain'][way][-1])
                     for way in ('segmenter', 'together')}
            yield '| ' + ' | '.join([
                _SETS[Path(root).name] if kind == KINDS[0] else '', kind,
                *(means[way] for way in ('as it is', 'GrabCut', 'true mask')),
                *(f'{means[way]}: {gain}' for way, gain in gains.items())]) + ' |'


def photo_table() -> Iterator[str]:
    """Yield the lines of the table of photographs."""
    yield '| background of the photographs | as it is | segmenter | segmenter, together |'
    yield '|---|---|---|---|'
    for background, found in json.loads(RESULTS.read_text())['photographs'].items():
        yield '| ' + ' | '.join([background, *(
            f'{each["first"]:.3f}; {each["mean"]:.3f} [{each["least"]:.3f}, '
            f'{each["greatest"]:.3f}]' for each in found.values())]) + ' |'


def _told(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return means and intervals over objects, ready for JSON."""
    ious = {way: np.array([row[way] for row in rows]) for way in WAYS}
    told: dict[str, Any] = {way: _intervals(values) for way, values in ious.items()}
    told['gain'] = {way: _intervals(ious[way] - ious['as it is']) for way in WAYS[1:]}
    told['silhouette'] = {
        way: round(float(np.mean([row['silhouette'][way] for row in rows])), 4)
        for way in WAYS[:-1]}
    return told


def _intervals(values: np.ndarray) -> list[dict[str, float]]:
    return [vars(mean_interval(values[:, place])) for place in range(len(COUNTS))]


@torch.inference_mode()
def _measured(network: Lifting, threshold: float, segmenter: Segmenter, views: ViewSet,
              kind: str, row: int) -> dict[str, Any]:
    """Return the IoUs of one object by each way after COUNTS, and those of its silhouettes."""
    length = max(COUNTS)
    batch, clean = (draw_posed_batch(
        views, 1, length, np.random.default_rng([_SEED, row]), augment, {kind: 1.0})
        for augment in (True, False))
    images, alpha = batch.images[:, 0], batch.alpha[:, 0]
    framed = _framed(segmenter, images, clean)
    agreed = {count: torch.from_numpy(np.stack(agreed_shares(framed[:count])))
              for count in COUNTS}
    shares = {'as it is': network.maps(images).foreground[:, 0].sigmoid(),
              'GrabCut': _grabcut(images, clean),
              'segmenter': torch.from_numpy(np.stack([each.shares for each in framed])),
              'together': agreed[length]}
    shown = {'as it is': images,
             **{way: _on_white(images, shares[way]) for way in ('GrabCut', 'segmenter')},
             'true mask': _on_white(images, alpha)}
    return {**{way: _ious(network, threshold, each, clean) for way, each in shown.items()},
            'together': [_ious(network, threshold, _on_white(images[:count], agreed[count]),
                               clean)[-1] for count in COUNTS],
            'silhouette': _silhouettes(shares, alpha, images[:, 3])}


def _on_white(images: Tensor, share: Tensor) -> Tensor:
    """Return images (T, 4, S, S) on white, by the object's share of each pixel, (T, S, S)."""
    colors = images[:, :3] * share[:, None] + 1 - share[:, None]
    return torch.cat([colors * images[:, 3:], images[:, 3:]], dim=1)


def _silhouettes(shares: Mapping[str, Tensor], alpha: Tensor, seen: Tensor) -> dict[str, float]:
    there = seen > 0.5
    truth = (alpha > 0.5) & there
    return {way: float(np.mean([
        float(((share > 0.5) & truth).sum() / (((share > 0.5) & there) | truth).sum().clamp(min=1))
        for share, truth, there in zip(found, truth, there, strict=True)]))
        for way, found in shares.items()}


def _framed(segmenter: Segmenter, images: Tensor, batch: PosedBatch) -> list[FramedShares]:
    """Return what the segmenter finds in each image (T, 4, S, S), with its camera."""
    shares = segmenter(images)[:, 0].sigmoid().numpy()
    pixels = [_pixels(image) for image in images]
    return [FramedShares(image, share, _camera(batch, place))
            for place, (image, share) in enumerate(zip(pixels, shares, strict=True))]


def _pixels(image: Tensor) -> NDArray[np.uint8]:
    """Return an image (C, S, S) in [0, 1] as (S, S, C) uint8."""
    return np.asarray((image.permute(1, 2, 0).numpy() * 255).round(), np.uint8)


def _camera(batch: PosedBatch, place: int) -> Camera:
    lens, side = batch.cameras.intrinsics[place, 0].numpy(), batch.images.shape[-1]
    return Camera(batch.cameras.poses[place, 0].numpy(), Intrinsics(
        lens[0, 0], lens[1, 1], lens[0, 2], lens[1, 2], side, side))


def _grabcut(images: Tensor, batch: PosedBatch) -> Tensor:
    """Return GrabCut's masks, (T, S, S); all of an image where it finds no two colours."""
    found = []
    for place, image in enumerate(images):
        mask = grabcut(_pixels(image[:3]), _camera(batch, place), 1.0)
        found.append(torch.ones(image.shape[1:]) if mask is None
                     else torch.from_numpy(mask).float())
    return torch.stack(found)


def _ious(network: Lifting, threshold: float, images: Tensor, batch: PosedBatch) -> list[float]:
    """Return the IoU at 32 cells after COUNTS views."""
    state, found = network.initial_state(1), []
    truth = functional.max_pool3d(batch.voxels, 2) > 0
    for row, image in enumerate(images, 1):
        cameras = Cameras(batch.cameras.poses[row - 1], batch.cameras.intrinsics[row - 1])
        state = network.step(image[None], cameras, state)
        if row in COUNTS:
            cells = functional.max_pool3d(network.decode(state).sigmoid(), 2) > threshold
            found.append(float(iou(cells, truth)[0]))
    return found


@torch.inference_mode()
def _of_photographs(weights: Path, segmenter: Path, folder: Path) -> dict[str, Any]:
    """Return the IoU after five even views before each background, by each way."""
    network, threshold = _network(weights)
    segmentation = Segmentation(TorchSegmenterRuntime(read_segmenter(segmenter)))
    photographs = read_photographs(folder)
    truth = hull(photographs, range(len(photographs)))
    found: dict[str, Any] = {}
    for background in BACKGROUNDS:
        images = [with_background(photographs, view, background)
                  for view in range(len(photographs))]
        framed = [segmentation.framed(image, camera)
                  for image, camera in zip(images, photographs.cameras, strict=True)]
        ious: dict[str, list[float]] = {way: [] for way in ('as it is', 'segmenter', 'together')}
        for start in range(len(photographs)):
            order = even_views(len(photographs), start)
            some = [framed[view] for view in order]
            shown = torch.stack([_planes(each.image) for each in some])
            shares = {'segmenter': [each.shares for each in some], 'together': agreed_shares(some)}
            for way in ious:
                pictures = shown if way == 'as it is' else _on_white(
                    shown, torch.from_numpy(np.stack(shares[way])))
                occupancy = _seen(network, pictures, Cameras.of([each.camera for each in some]))
                ious[way].append(float(iou(averaged(occupancy, len(truth)) > threshold, truth)))
        found[background] = {way: {'first': values[0], 'mean': float(np.mean(values)),
                                   'least': min(values), 'greatest': max(values)}
                             for way, values in ious.items()}
    return found


def _planes(image: NDArray[np.uint8]) -> Tensor:
    planes = torch.from_numpy(image).permute(2, 0, 1).float() / 255
    seen = planes[3:] if len(planes) == 4 else torch.ones_like(planes[:1])
    return torch.cat([planes[:3], seen])


def _seen(network: Lifting, images: Tensor, cameras: Cameras) -> NDArray[np.float32]:
    """Return the occupancy (64, 64, 64) after views (T, 4, S, S) of cameras (T,)."""
    state = network.initial_state(1)
    for row, image in enumerate(images):
        state = network.step(image[None], cameras.rows(slice(row, row + 1)), state)
    return network.decode(state)[0].sigmoid().numpy()


if __name__ == '__main__':
    main()
