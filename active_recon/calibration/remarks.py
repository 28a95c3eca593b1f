"""What to know before relying on a calibration, in plain words."""

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

_GOOD_ERROR = 1 / 640  # of the image's width
_EXACT_ANGLE = math.radians(1)
_MUCH_WORSE = 3.0  # than the overall error

LENS_HALF_KNOWN = (
    "The lens's centre and distortion are taken as ideal: a flat board on a table does not tell "
    'them. Give --camera-info, or by --lens-images ten images of the board tilted in the hand.')
DIRECTION_UNKNOWN = (
    'Which way the angle of the table grows is not known: give --step-deg or --angles-deg, or '
    'set turntable_direction to 1 (counter-clockwise seen from above) or -1.')


def of_missing(names: Sequence[str]) -> list[str]:
    """Return what to say of images in which the board is not seen."""
    return [f'The board is not seen in {", ".join(names)}.'] if names else []


def of_angles(found: TurntableFit) -> list[str]:
    """Return what to say of angles that are not quite where the images show the table."""
    if found.off is None or (worst := float(np.abs(found.off).max())) <= _EXACT_ANGLE:
        return []
    name = found.images[int(np.argmax(np.abs(found.off)))].seen.name
    return [f'The given angles are up to {math.degrees(worst):.1f} degrees off what the '
            f'images show ({name}): does the table slip, or have play?']


def of_elevation(camera: Camera) -> list[str]:
    """Return what to say of a camera that the networks never saw."""
    if abs(camera.elevation - CANONICAL_ELEVATION) <= ELEVATION_TOLERANCE:
        return []
    return [f'The camera stands at an elevation of {math.degrees(camera.elevation):.0f} degrees; '
            f'the networks know {math.degrees(CANONICAL_ELEVATION):.0f}.']


def of_errors(images: Sequence[ImageFit]) -> list[str]:
    """Return what to say of a large error, and of images far worse than the others."""
    error, good = overall_error(images), images[0].seen.size[0] * _GOOD_ERROR
    remarks = [] if error <= good else [
        f'An error of {error:.1f} pixels is much: below {good:.1f} is usual. Is the board flat, '
        'are the images sharp, and the motion exact?']
    worse = [one.seen.name for one in images if one.error > _MUCH_WORSE * error]
    return remarks + ([f'Much worse than the others: {", ".join(worse)}.'] if worse else [])


def of_cube(images: Sequence[ImageFit], lens: Intrinsics, board_from_object: NDArray[np.float64],
            object_size: float) -> list[str]:
    """Return what to say where the object's cube is not in an image."""
    corners = cube_corners(object_size)
    for one in images:
        pixels = project(lens, corners, one.camera_from_board @ board_from_object)
        if not ((pixels >= 0) & (pixels <= [lens.width, lens.height])).all():
            return [f"The object's cube of {object_size:g} m is not wholly in the image "
                    f'{one.seen.name}, nor perhaps in others.']
    return []
