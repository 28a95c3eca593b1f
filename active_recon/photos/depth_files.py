"""Depth images beside photos: where they are, and their values in metres."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from active_recon.errors import DataError
from active_recon.file_names import comparable
from active_recon.volumes.depth_images import MM_PER_METRE
import cv2
import numpy as np
from numpy.typing import NDArray

FOLDER, SUFFIX = 'depth', '_depth'
"""Of the depth of `a.jpg`: `depth/a.png`, or `a_depth.png` beside it."""
_ENDINGS = ('.png', '.tif', '.tiff')
_SHAPE_OFF = 0.01


def is_depth(path: Path) -> bool:
    """Return whether a file among photos is the depth of one of them, by its name."""
    return path.stem.lower().endswith(SUFFIX) and path.suffix.lower() in _ENDINGS


def depth_files(photos: Sequence[Path]) -> Mapping[Path, Path]:
    """Return the depth image of each photo that has one beside it or in `depth`."""
    found = {}
    for folder in {photo.parent for photo in photos}:
        beside = {comparable(path.stem): path for place in (folder, folder / FOLDER)
                  if place.is_dir() for path in sorted(place.iterdir())
                  if path.suffix.lower() in _ENDINGS and (place != folder or is_depth(path))}
        for photo in (each for each in photos if each.parent == folder):
            for stem in (f'{photo.stem}{SUFFIX}', photo.stem):
                if (path := beside.get(comparable(stem))) and path != photo:
                    found[photo] = path
                    break
    return found


def read_depth(path: Path, width: int, height: int,
               turned: Callable[[NDArray[Any]], NDArray[Any]] = lambda stored: stored
               ) -> NDArray[np.float32]:
    """
    Return depth in metres, of a photo's size in pixels (height, width); 0 is no value.

    Reads one channel of 16 bits in millimetres, or of floats in metres, which `turned` turns as
    the photo, of any size of the photo's shape. Raises DataError on another file.
    """
    if not path.is_file():
        raise DataError(f'{path}: no depth image: expected the file that the cameras name, '
                        'found none')
    stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if stored is None or stored.ndim != 2 or stored.dtype not in (
            np.uint16, np.float32, np.float64):
        found = 'no image' if stored is None else f'the shape {stored.shape} {stored.dtype}'
        raise DataError(f'{path.name}: no depth image: expected one channel of 16 bits in '
                        f'millimetres, or of floats in metres, got {found}')
    stored = turned(stored)
    if abs(stored.shape[1] * height - width * stored.shape[0]) > _SHAPE_OFF * stored.size:
        raise DataError(f'{path.name}: depth of another size: expected {width} x {height} pixels '
                        f'or the same shape, got {stored.shape[1]} x {stored.shape[0]}')
    metres = stored.astype(np.float32) / (MM_PER_METRE if stored.dtype == np.uint16 else 1)
    # OpenCV's other nearest pixel is the one at the left and above, up to half a pixel away
    sized = cv2.resize(metres, (width, height), interpolation=cv2.INTER_NEAREST_EXACT)
    return np.asarray(np.where(np.isfinite(sized), sized, 0), np.float32)
