"""How often the table under an object is found in photos, and how far off its height is."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from active_recon.geometry.cameras import Camera
from active_recon.photos.cube import first_cube, NARROWER
from active_recon.photos.ground_search import found_ground
from active_recon.photos.views import PhotoView
from benchmarks.photos_on_tables import scenes, SIZE, some_models
import cv2
import numpy as np
from numpy.typing import NDArray
from phone_photos import as_of_a_phone
from photo_table import PATTERNS

_ANGLE, _SHARE = np.radians(0.3), 0.003  # rad, and of the distance, by which poses are off
_UP = np.array([0.0, 0.0, 1.0])
Image = NDArray[np.uint8]
Change = Callable[[Image, Camera, np.random.Generator], tuple[Image, Camera]]


def _with_wrong_pose(image: Image, camera: Camera, rng: np.random.Generator
                     ) -> tuple[Image, Camera]:
    pose = camera.pose.copy()
    turn, _ = cv2.Rodrigues(rng.normal(0, _ANGLE, 3))
    pose[:3, :3] = turn @ pose[:3, :3]
    pose[:3, 3] += rng.normal(0, _SHARE * camera.distance, 3)
    return image, Camera(pose, camera.intrinsics)


KINDS: Mapping[str, Change] = {
    'as they are': lambda image, camera, rng: (image, camera),
    'as of a phone': lambda image, camera, rng: (as_of_a_phone(image, rng), camera),
    'poses off by 0.3 degrees and 0.3 %': _with_wrong_pose}


def grounds(count: int) -> dict[str, Any]:
    """
    Return the errors of tables' heights, relative to the object's longest side, by photos.

    There is one for each of `count` models, by the table's pattern; None where none was found.
    """
    found: dict[str, dict[str, list[float | None]]] = {
        kind: {pattern: [] for pattern in PATTERNS} for kind in KINDS}
    for mesh, pattern, photos, _, rng in scenes(some_models(count)):
        under = np.array([0.0, 0.0, mesh.bounds[0, 2]])
        for kind, change in KINDS.items():
            views = [PhotoView(photo.name, *change(photo.image, photo.camera, rng))
                     for photo in photos]
            start = first_cube([view.camera for view in views], _UP, NARROWER)
            ground = found_ground(views, start.centre, _UP)
            found[kind][pattern].append(
                None if ground is None else abs(float(ground.height(under))) / SIZE)
    return found


def ground_table(found: Mapping[str, Mapping[str, list[float | None]]]) -> Iterator[str]:
    """Yield the lines of the table of tables that were found."""
    yield ('| photos | ' + ' | '.join(f'{words}: found; error, mean (greatest)' for words in (
        'boards of wood', 'fine spots', 'coarse spots')) + ' |')
    yield '|---|---|---|---|'
    for kind, patterns in found.items():
        told = [_told(patterns[pattern]) for pattern in ('boards', 'fine', 'coarse')]
        yield f'| {kind} | {" | ".join(told)} |'


def _told(errors: list[float | None]) -> str:
    known = [100 * error for error in errors if error is not None]
    told = f'{len(known)} of {len(errors)}'
    return f'{told}; {np.mean(known):.1f} % ({max(known):.1f})' if known else told
