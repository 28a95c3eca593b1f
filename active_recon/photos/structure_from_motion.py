"""
Cameras of photos that overlap, from nothing but the photos: structure from motion by COLMAP.

COLMAP (Schönberger and Frahm, Structure-from-Motion Revisited, CVPR 2016) runs as the library
pycolmap, on the CPU. It gets upright, smaller copies of the photos.
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
from itertools import combinations, count
import math
from pathlib import Path
import signal
from tempfile import TemporaryDirectory
import threading
from typing import Any

from active_recon.errors import ConfigError, DataError
from active_recon.photos.camera_file import CameraFile, Lens, PosedPhoto
from active_recon.photos.colmap import colmap_lens
from active_recon.photos.files import PhotoFile, read_photo
from active_recon.photos.likely_pairs import likely_pairs
from active_recon.reporting import Advance, by_step, Reporting, silent
import cv2
import numpy as np
from numpy.typing import NDArray

FEWEST = 3
"""Photos that have to fit together, and half of all: fewer show a part, if they are right."""
_WAYS = (('finding the cameras', False), ('finding more of the cameras', True))
_NAME = 'structure from motion'
_LONGEST = 1600  # pixels of a copy: more takes longer and hardly finds more
_FEATURES = 2048  # of a photo; 4096 take twice the time for half the error
_AT_ONCE = 8  # copies that all cores work on together
_PAIRS_AT_ONCE = 32  # between such blocks COLMAP hears that it is to stop
_INLIERS = {'init_min_num_inliers': 40, 'abs_pose_min_num_inliers': 15,
            'abs_pose_min_inlier_ratio': 0.15}
"""Fewer than COLMAP's own: it is made for photos of large places, with more to see in them."""
_LENSES = {'min_focal_length_ratio': 0.4, 'max_focal_length_ratio': 10.0, 'max_extra_param': 0.5}
"""What a camera has: beyond, photos were fitted together that do not belong so."""


def sfm_photos(photos: Sequence[PhotoFile], reporting: Reporting = silent
               ) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
    """
    Return the cameras of the photos that fit together, and why others are left out.

    The world's origin, axes and scale are arbitrary. Photos of one size and of one focal length
    by EXIF share a lens, which is estimated. Where some photos do not fit, all pairs are tried
    again with features that are less sensitive to the side that they are seen from. Raises
    ConfigError where pycolmap is not installed, DataError where fewer than FEWEST photos fit, or
    than half.
    """
    colmap = _library()
    found: Mapping[str, tuple[NDArray[np.float64], Lens]] = {}
    with TemporaryDirectory() as place:
        copies, left_out = _copies(photos, Path(place), reporting)
        for title, patient in _WAYS if len(copies) >= FEWEST else ():
            with reporting(title, 2 * len(copies)) as advance, TemporaryDirectory() as own:
                cameras = _cameras(colmap, copies, Path(place), Path(own), patient, advance)
            found = max(found, cameras, key=len)
            if len(found) == len(copies):
                break
    needed = max(FEWEST, math.ceil(len(copies) / 2))
    if len(found) < needed:
        raise DataError(
            f'{_NAME}: no cameras found: expected {needed} photos or more that fit together, got '
            f'{len(found)} of {len(photos)}; take 15 or more around the object, each at most 20 '
            'degrees from the one before, with the object on something finely patterned, such as '
            'a newspaper, or use --board', 'no_cameras')
    return (CameraFile(_NAME, ()),
            [PosedPhoto(copy.photo, found[copy.name][0],
                        found[copy.name][1](copy.photo.upright_size))
             for copy in copies if copy.name in found],
            [*left_out, *(f'{copy.photo.name}: no camera found: it does not fit the other photos'
                          for copy in copies if copy.name not in found)])


@dataclass(frozen=True)
class _Copy:
    """A photo's copy: its name, and its width and height in pixels."""

    photo: PhotoFile
    name: str
    size: tuple[int, int]


def _copies(photos: Sequence[PhotoFile], folder: Path,
            reporting: Reporting) -> tuple[list[_Copy], list[str]]:
    """Write upright copies of photos, at most _LONGEST large; tell which cannot be read."""
    copies, left_out = [], []
    with reporting('copying the photos', len(photos)) as advance:
        for number, photo in enumerate(photos):
            name = f'{number:05}.png'
            advance(1, photo.name)
            try:
                pixels = np.ascontiguousarray(read_photo(photo)[..., 2::-1])
            except DataError as error:
                left_out.append(str(error))
                continue
            scale = min(1.0, _LONGEST / max(pixels.shape))
            pixels = np.asarray(cv2.resize(pixels, None, fx=scale, fy=scale,
                                           interpolation=cv2.INTER_AREA), np.uint8)
            cv2.imwrite(str(folder / name), pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])
            copies.append(_Copy(photo, name, (pixels.shape[1], pixels.shape[0])))
    return copies, left_out


def _library() -> Any:
    """Return pycolmap; raises ConfigError where it is not installed."""
    heard = signal.getsignal(signal.SIGTERM)
    try:
        colmap = import_module('pycolmap')
    except ImportError as error:
        raise ConfigError(f'{_NAME}: not possible here: expected the package pycolmap, got: '
                          f"{error}; install it by: pip install 'active_recon[sfm]'") from error
    if threading.current_thread() is threading.main_thread():
        # Its log would end the process on its own, with a trace, and leave the copies there
        signal.signal(signal.SIGTERM, heard or signal.SIG_DFL)
    colmap.logging.minloglevel = int(colmap.logging.FATAL)  # the terminal belongs to the photos
    colmap.set_random_seed(0)
    return colmap


def _cameras(colmap: Any, copies: Sequence[_Copy], folder: Path, own: Path, patient: bool,
             advance: Advance) -> Mapping[str, tuple[NDArray[np.float64], Lens]]:
    """
    Return the poses and lenses of the largest model, by the names of the copies.

    `advance` is told two steps for each copy.
    """
    database, reached, done = own / 'database.db', by_step(advance), 0
    extraction, matching = colmap.FeatureExtractionOptions(), colmap.FeatureMatchingOptions()
    extraction.sift.max_num_features = _FEATURES
    extraction.sift.estimate_affine_shape = matching.guided_matching = patient
    of_lenses: dict[tuple[tuple[int, int], float | None], list[_Copy]] = {}
    for copy in copies:
        of_lenses.setdefault((copy.size, copy.photo.focal), []).append(copy)
    for number, ((size, focal), group) in enumerate(of_lenses.items(), 1):
        reader = colmap.ImageReaderOptions()
        if focal is not None:
            focal *= max(size) / max(group[0].photo.size)
            reader.camera_params = f'{focal},{size[0] / 2},{size[1] / 2},0'
        for first in range(0, len(group), _AT_ONCE):
            names = [copy.name for copy in group[first:first + _AT_ONCE]]
            colmap.extract_features(database, folder, names, colmap.CameraMode.SINGLE, reader,
                                    extraction, colmap.Device.cpu)
            reader.existing_camera_id = number  # COLMAP counts them so
            done += len(names)
            reached(done, 'features')
    pairing = colmap.ImportedPairingOptions()
    pairing.match_list_path, pairing.block_size = own / 'pairs.txt', _PAIRS_AT_ONCE
    pairs = combinations([copy.name for copy in copies], 2) if patient else _likely_pairs(
        colmap, database)
    pairing.match_list_path.write_text(''.join(f'{one} {other}\n' for one, other in pairs))
    colmap.match_image_pairs(database, matching, pairing, device=colmap.Device.cpu)
    mapping = colmap.IncrementalPipelineOptions()
    for name, value in {**_INLIERS, **_LENSES}.items():
        setattr(mapping.mapper, name, value)
    tried = count(done)  # of the same photo several times, perhaps
    models = colmap.incremental_mapping(
        database, folder, own, mapping,
        next_image_callback=lambda: reached(min(next(tried), 2 * done), 'cameras'))
    reached(2 * done, 'cameras')
    model = max(models.values(), key=lambda each: int(each.num_reg_images()), default=None)
    return {} if model is None else {
        image.name: _camera(image) for image in model.images.values() if image.has_pose}


def _likely_pairs(colmap: Any, database: Path) -> list[tuple[str, str]]:
    """Return the names of the copies that are compared; see `likely_pairs`."""
    with closing(colmap.Database.open(database)) as features:
        images = features.read_all_images()
        shapes = [features.read_keypoints(image.image_id)[:, 2:] for image in images]  # 2 x 2 each
        pairs = likely_pairs(
            [features.read_descriptors(image.image_id).data for image in images],
            [np.abs(each[:, 0] * each[:, 3] - each[:, 1] * each[:, 2]) for each in shapes])
    return [(images[one].name, images[other].name) for one, other in pairs]


def _camera(image: Any) -> tuple[NDArray[np.float64], Lens]:
    """Return the pose, world from optical frame, and the lens that COLMAP found for an image."""
    camera_from_world, camera = np.eye(4), image.camera
    camera_from_world[:3] = image.cam_from_world().matrix()
    return np.asarray(np.linalg.inv(camera_from_world)), colmap_lens(
        camera.model.name, camera.width, camera.height, tuple(map(float, camera.params)))
