"""Photos of objects on tables before clutter: poses are known, masks are not."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
import sys
from typing import Any

from active_recon.errors import ActiveReconError
from active_recon.evaluation.statistics import mean_interval
from active_recon.photos.camera_file import CameraFile
from active_recon.photos.cube import MARGIN
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_views
from active_recon.photos.views import PhotoView
from active_recon.volumes.meshes import load_mesh
from benchmarks.world_iou import iou_around
import numpy as np
from numpy.typing import NDArray
from photo_table import around, centred, PATTERNS, photographed

MODELS = Path(__file__).parent / 'real_cc0'
SIZE = 0.14
"""Of an object on a table or board, metres."""
_WAYS = ('the cube found', 'the cube told', 'the cube told, `--background network`',
         'the cube told, true masks')
_VIEWS = 8


def on_tables(count: int, model: str) -> dict[str, Any]:
    """Return the IoU of objects on tables, by what is known beside the poses, with intervals."""
    found: dict[str, list[float]] = {way: [] for way in _WAYS}
    models, file = some_models(count), CameraFile('true', (), np.array([0.0, 0.0, 1.0]))
    for each, (mesh, pattern, views, masks, _) in zip(models, scenes(models), strict=True):
        masked = [replace(view, mask=mask, mask_source='masks')
                  for view, mask in zip(views, masks, strict=True)]
        free = Options(model=model)
        told = replace(free, box=(0.0, 0.0, 0.0, MARGIN * SIZE))
        for way, (some, options) in zip(_WAYS, (
                (views, free), (views, told),
                (views, replace(told, background='network')), (masked, told)), strict=True):
            try:
                shape = from_views(some, file, options)
                occupied = shape.occupancy > shape.threshold
                found[way].append(iou_around(
                    occupied, shape.cube.world_from_object(1.0), mesh))
            except ActiveReconError as error:
                print(f'nothing: {error}', file=sys.stderr)  # noqa: T201
                found[way].append(0.0)
        print(each.stem, pattern, {  # noqa: T201
            way: round(values[-1], 3) for way, values in found.items()},
            file=sys.stderr, flush=True)
    return {'objects': [each.stem for each in models], 'views': _VIEWS,
            'each': found, 'iou': {way: interval(values) for way, values in found.items()}}


def scenes(models: Sequence[Path]) -> Iterator[tuple[
        Any, str, list[PhotoView], list[NDArray[np.bool_]], np.random.Generator]]:
    """Yield the mesh of each model, its table's pattern, photos, true masks, and the generator."""
    for number, each in enumerate(models):
        rng = np.random.default_rng(number)
        mesh = centred(load_mesh(each), SIZE)
        cameras = around(_VIEWS, 3 * SIZE, rng)
        pattern = list(PATTERNS)[number % len(PATTERNS)]
        images, masks = photographed(mesh, cameras, pattern, rng)
        yield mesh, pattern, [PhotoView(str(view), image, camera) for view, (image, camera)
                              in enumerate(zip(images, cameras, strict=True))], masks, rng


def some_models(count: int) -> list[Path]:
    """Return the files of so many of the models that ship, at even steps."""
    files = sorted(MODELS.glob('*/*.glb'))
    return [files[number * len(files) // count] for number in range(count)]


def interval(values: Sequence[float]) -> Mapping[str, float]:
    """Return the mean of objects and its interval, ready for JSON."""
    found = mean_interval(np.array(values))
    return {'mean': found.mean, 'low': found.low, 'high': found.high}
