r"""
Photos of which nothing is known: what `active-recon reconstruct --sfm` makes of them.

    PYTHONPATH=test python -m benchmarks.photos_alone --out docs/results/photos-alone.json

CC0 models that ship, 14 cm large, stand on a newspaper before clutter. COLMAP finds the cameras of
all photos; eight of them at even steps give the shape, beside the same photos with true cameras.
The worlds are laid over each other by the places of the cameras.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
import json
from pathlib import Path
from tempfile import TemporaryDirectory
import time
from typing import Any

from active_recon.errors import ActiveReconError
from active_recon.geometry.cameras import Camera
from active_recon.photos.camera_file import CameraFile
from active_recon.photos.files import open_photos, photo_paths
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_views
from active_recon.photos.shape import Shape
from active_recon.photos.structure_from_motion import sfm_photos
from active_recon.photos.views import even_choice, load_views, PhotoView
from active_recon.volumes.meshes import load_mesh
from benchmarks.photos_on_tables import interval, SIZE, some_models
from benchmarks.studies import with_tables_between_marks
from benchmarks.world_iou import iou_around
import numpy as np
from numpy.typing import NDArray
from photo_table import around, centred, photographed, PRINT
from PIL import Image
from rich.progress import track
from trimesh.registration import procrustes

_PHOTOS, _USED = 24, 8
_DISTANCE = 3 * SIZE


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(description='Photos without cameras in, shapes out.')
    parser.add_argument('--objects', type=int, default=12)
    parser.add_argument('--out', type=Path, default=Path('photos-alone.json'))
    options = parser.parse_args()
    models = some_models(options.objects)
    rows = [_measured(each, number) for number, each in enumerate(track(models, 'photos alone'))]
    result = {
        'command': 'PYTHONPATH=test python -m benchmarks.photos_alone --objects '
                   f'{options.objects} --out docs/results/photos-alone.json',
        'photos': _PHOTOS, 'used': _USED,
        **{name: interval([row[name] for row in rows]) for name in rows[0] if name != 'object'},
        'each': rows}
    options.out.write_text(json.dumps(result, indent=1) + '\n')


def _measured(model: Path, number: int) -> Mapping[str, Any]:
    """Return what became of the photos of one object."""
    rng = np.random.default_rng(number)
    mesh = centred(load_mesh(model), SIZE)
    cameras = around(_PHOTOS, _DISTANCE, rng)
    images, _ = photographed(mesh, cameras, PRINT, rng)
    with TemporaryDirectory() as place:
        for count, image in enumerate(images):
            Image.fromarray(image).save(Path(place) / f'{count:02}.jpg', quality=92)
        photos, _ = open_photos(photo_paths(Path(place)))
        began = time.monotonic()
        file, posed, _ = sfm_photos(photos)
        took_s = time.monotonic() - began
        views, _ = load_views(even_choice(posed, _USED), None, lambda steps, note: None)
    at = [int(each.photo.path.stem) for each in posed]
    true_from_found, _, _ = procrustes(
        np.stack([each.pose[:3, 3] for each in posed]),
        np.stack([cameras[count].position for count in at]), reflection=False)
    off = [np.linalg.norm((true_from_found @ each.pose)[:3, 3] - cameras[count].position)
           for each, count in zip(posed, at, strict=True)]
    told = CameraFile('true', (), np.array([0.0, 0.0, 1.0]))
    known = [PhotoView(view.name, view.image, _sized(cameras[int(Path(view.name).stem)], view))
             for view in views]
    alone, known_iou = (_iou(views, file, mesh, true_from_found),
                        _iou(known, told, mesh, np.eye(4)))
    return {'object': model.stem, 'placed': len(posed) / _PHOTOS, 'took_s': took_s,
            'position_error': float(np.median(off)) / _DISTANCE, 'iou': alone,
            'iou_cameras_told': known_iou, 'difference': alone - known_iou}


def _sized(camera: Camera, view: PhotoView) -> Camera:
    """Return a true camera with the size that a view has."""
    lens = view.camera.intrinsics
    return Camera(camera.pose, camera.intrinsics.resized(lens.width, lens.height))


def _iou(views: Sequence[PhotoView], file: CameraFile, mesh: Any,
         true_from_found: NDArray[np.float64]) -> float:
    """Return the IoU of the shape in the world of the true cameras; 0 where there is none."""
    try:
        shape: Shape = from_views(views, file, Options(threads=2))
    except ActiveReconError:
        return 0.0
    return iou_around(shape.occupancy > shape.threshold,
                      true_from_found @ shape.cube.world_from_object(1.0), mesh)


def table(result: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of the table of doc/photos.md."""
    yield (f'| {len(result["each"])} models on a newspaper, {result["photos"]} photos | mean, '
           '95 % interval over objects |')
    yield '|---|---|'
    for name, words, form in (
            ('placed', 'photos whose camera is found', '.0%'),
            ('position_error', 'error of their places, median of an object, of the distance',
             '.2%'),
            ('iou', f'IoU, {result["used"]} of the photos, from the photos alone', '.3f'),
            ('iou_cameras_told', 'IoU of the same photos, with true cameras', '.3f'),
            ('difference', 'difference of the two, paired', '.3f'),
            ('took_s', 'seconds to find the cameras', '.0f')):
        mean, low, high = (f'{result[name][part]:{form}}'.replace('%', ' %')
                           for part in ('mean', 'low', 'high'))
        yield f'| {words} | {mean} [{low}, {high}] |'


def with_table(text: str, result: Mapping[str, Any]) -> str:
    """Return a page with the table between its marks."""
    return with_tables_between_marks(text, {'photos-alone': lambda: table(result)})


if __name__ == '__main__':
    main()
