"""
Measurement on real photographs: IoU with the visual hull of all silhouettes.

The true shape is unknown; the hull of all views at 32 cells a side is the reference. A cell
belongs to it if its centre is in every silhouette, so probabilities at 64 cells are averaged to
32, instead of taking the largest.
"""

from collections.abc import Callable, Sequence
from typing import Any

from active_recon.datasets.middlebury import PosedPhotographs
from active_recon.datasets.views import with_seen
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.geometry.canonical import framed_layers
from active_recon.models.lifted import cell_centers
from active_recon.models.network import Cameras
from active_recon.volumes.voxels import iou, RESOLUTION
import cv2
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

BACKGROUNDS = ('as it is', 'white', 'clutter')
EVEN = 5
_TILES = (16, 12)


def hull(photographs: PosedPhotographs, chosen: Sequence[int],
         side: int = RESOLUTION) -> NDArray[np.bool_]:
    """Return the visual hull of the silhouettes of some views, (side, side, side) bool."""
    centers = cell_centers(side).numpy()
    inside = np.ones(len(centers), np.bool_)
    for view in chosen:
        mask = photographs.masks[view]
        pixels, depth = photographs.cameras[view].project(centers)
        column, row = np.floor(pixels).astype(int).T
        there = ((column >= 0) & (column < mask.shape[1]) & (row >= 0) & (row < mask.shape[0])
                 & (depth > 0))
        inside[there] &= mask[row[there], column[there]]
    return inside.reshape(side, side, side)


def even_views(count: int, start: int = 0, views: int = EVEN) -> list[int]:
    """Return the indices of `views` even steps, from `start`, on a ring of `count` photographs."""
    return [(start + step * count // views) % count for step in range(views)]


def with_background(photographs: PosedPhotographs, view: int,
                    background: str) -> NDArray[np.uint8]:
    """Return a photograph with one of BACKGROUNDS, (H, W, 3) uint8 RGB."""
    image, mask = photographs.images[view], photographs.masks[view][..., None]
    if background == 'as it is':
        return image
    if background == 'white':
        return np.where(mask, image, np.uint8(255))
    columns, rows = _TILES
    drawn = np.random.default_rng(view).integers(0, 256, (rows, columns, 3), np.uint8)
    behind = cv2.resize(drawn, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return np.where(mask, image, behind).astype(np.uint8)


@torch.inference_mode()
def photograph_figures(photographs: PosedPhotographs, entrants: Sequence[Entrant],
                       views: int = EVEN,
                       advance: Callable[[int], None] = lambda done: None) -> dict[str, Any]:
    """
    Return the IoU at 32 cells after 1 to `views` even views, ready for JSON.

    For each entrant and background: `iou` for the sequence that begins with the first photograph,
    and the mean, least and greatest over sequences that begin with any of them. `hull` is the IoU
    of the visual hull of the same views.
    """
    count = len(photographs)
    views = min(views, count)
    truth = hull(photographs, range(count))
    sequences = [even_views(count, start, views) for start in range(count)]
    carved = _spread([[float(iou(hull(photographs, order[:step + 1]), truth))
                       for step in range(views)] for order in sequences])
    result: dict[str, Any] = {
        'folder': str(photographs.folder), 'photographs': count, 'views': sequences[0],
        'cells': int(truth.sum()), 'hull': carved, 'models': {},
        'left_out': {each.name: 'it takes canonical cameras alone'
                     for each in entrants if each.network.needs_front}}
    for entrant in entrants:
        if entrant.network.needs_front:
            advance(len(BACKGROUNDS))
            continue
        figures: dict[str, Any] = {'threshold': _threshold(entrant)}
        result['models'][entrant.name] = figures
        for background in BACKGROUNDS:
            shown, cameras = _shown(photographs, background, entrant.network.image_size)
            encoded = [entrant.network.encode(one[None], cameras.rows(slice(view, view + 1)))
                       for view, one in enumerate(shown)]
            figures[background] = _spread([
                _iou_after(entrant, encoded, cameras, order, truth) for order in sequences])
            advance(1)
    return result


def _shown(photographs: PosedPhotographs, background: str,
           size: int) -> tuple[list[Tensor], Cameras]:
    """Return the network's images of the photographs, (4, S, S) each, and their cameras (V,)."""
    pictures, cameras = [], []
    for view, camera in enumerate(photographs.cameras):
        layers, seen, framed = framed_layers(with_background(photographs, view, background),
                                             camera, 1.0, size)
        picture = torch.from_numpy(layers).permute(2, 0, 1).float() / 255
        pictures.append(with_seen(picture, torch.from_numpy(seen)))
        cameras.append(framed)
    return pictures, Cameras.of(cameras)


def _iou_after(entrant: Entrant, encoded: Sequence[Tensor], cameras: Cameras,
               order: Sequence[int], truth: NDArray[np.bool_]) -> list[float]:
    """Return the IoU after each view of an order."""
    network, found = entrant.network, []
    state = network.initial_state(1)
    for view in order:
        state = network.update(encoded[view], cameras.rows(slice(view, view + 1)), state)
        occupancy = network.decode(state).float().sigmoid()[0].cpu().numpy()
        occupied = averaged(occupancy, len(truth)) > _threshold(entrant)
        found.append(float(iou(occupied, truth)))
    return found


def _threshold(entrant: Entrant) -> float:
    """Return the threshold at the entrant's own resolution; means have the same scale."""
    return entrant.thresholds[max(entrant.sides)]


def averaged(values: NDArray[np.floating], side: int) -> NDArray[np.floating]:
    """Return the means of values (R, R, R) over blocks, (side, side, side)."""
    factor = len(values) // side
    return np.asarray(values.reshape(side, factor, side, factor, side, factor).mean((1, 3, 5)))


def _spread(rows: list[list[float]]) -> dict[str, list[float]]:
    """Return the first of rows (S, T), and the mean, least and greatest over all rows."""
    values = np.array(rows)
    return {'iou': values[0].tolist(), 'mean': values.mean(axis=0).tolist(),
            'least': values.min(axis=0).tolist(), 'greatest': values.max(axis=0).tolist()}
