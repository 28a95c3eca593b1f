"""Warnings about the result of a calibration."""

from collections.abc import Sequence
import math

from active_recon.calibration.fit import ImageFit, overall_error
from active_recon.calibration.lens import project
from active_recon.calibration.placement import cube_corners
from active_recon.calibration.turntable import TurntableFit
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_ELEVATION,
    ELEVATION_TOLERANCE,
    Intrinsics,
)
import numpy as np
from numpy.typing import NDArray

_GOOD_ERROR = 1 / 640  # in image widths
_EXACT_ANGLE = math.radians(1)
_MUCH_WORSE = 3.0  # relative to the overall error

LENS_HALF_KNOWN = (
    'An ideal principal point and no lens distortion are assumed, because images of a flat board '
    'on a table do not determine them. Give --camera-info, or ten images of the board held at '
    'various tilts by --lens-images.')
DIRECTION_UNKNOWN = (
    "The direction of the turntable's angle is unknown: give --step-deg or --angles-deg, or set "
    'turntable_direction to 1 (counter-clockwise seen from above) or -1.')
SCALE_UNKNOWN = (
    'All images look at one point from one distance: squares of another size, or poses in another '
    'unit than metres, would not be noticed. Measure a square, or add images from nearer and '
    'farther.')


def of_missing(names: Sequence[str]) -> list[str]:
    """Return a warning if there are images without the board."""
    return [f'The board was not found in {", ".join(names)}.'] if names else []


def of_angles(found: TurntableFit) -> list[str]:
    """Return a warning if the given angles differ from those in the images by over a degree."""
    if found.off is None or (worst := float(np.abs(found.off).max())) <= _EXACT_ANGLE:
        return []
    name = found.images[int(np.argmax(np.abs(found.off)))].seen.name
    return [f'The given angles differ from those in the images by up to '
            f'{math.degrees(worst):.1f} degrees ({name}): the table may slip or have backlash.']


def of_elevation(camera: Camera) -> list[str]:
    """Return a warning if the elevation is not that of the paper's networks."""
    if abs(camera.elevation - CANONICAL_ELEVATION) <= ELEVATION_TOLERANCE:
        return []
    return [f'The camera is at an elevation of {math.degrees(camera.elevation):.0f} degrees; '
            f"the paper's networks expect {math.degrees(CANONICAL_ELEVATION):.0f}."]


def of_errors(images: Sequence[ImageFit]) -> list[str]:
    """Return warnings of a large error, and of images with a much larger one than the others."""
    error, good = overall_error(images), images[0].seen.size[0] * _GOOD_ERROR
    remarks = [] if error <= good else [
        f'The error of {error:.1f} pixels is large (usual: below {good:.1f}). Check that the '
        'board is flat, the images are sharp, the motion is exact, and the camera info, if given, '
        'that of this camera.']
    worse = [one.seen.name for one in images if one.error > _MUCH_WORSE * error]
    return remarks + ([f'Images with a much larger error: {", ".join(worse)}.'] if worse else [])


def of_cube(images: Sequence[ImageFit], lens: Intrinsics, board_from_object: NDArray[np.float64],
            object_size: float) -> list[str]:
    """Return a warning if the object's cube is partly outside of an image."""
    corners = cube_corners(object_size)
    for one in images:
        pixels = project(lens, corners, one.camera_from_board @ board_from_object)
        if not ((pixels >= 0) & (pixels <= [lens.width, lens.height])).all():
            return [f"The object's cube of {object_size:g} m is partly outside of the image "
                    f'{one.seen.name}, perhaps of others too.']
    return []
