"""
Which pixels of photos show the table under an object, and which something above it.

What a pixel shows is in the table, or on its ray at some height above it, and other photos show
that place in the same colour. So the table's plane is swept upward, as in Collins, "A space-sweep
approach to true multi-image matching", CVPR 1996, and the heights are held against the table.
Where all around has one colour, neither is told. A photo in which something hides the place tells
little.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.photos.board_print import steps, UNIFORM
from active_recon.photos.ground import Ground
from active_recon.photos.seen_photo import SeenPhoto
from active_recon.photos.views import even_choice
import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

_HEIGHTS = 8  # above the table, up to the cube's top
_LOWEST = 0.04  # of them, in sides of the cube
_OTHERS = 4  # photos that a photo is compared with, at even steps
_BLUR = 0.8  # pixels
_NOISE = 8.0  # grey levels
_OF_STEP = 0.5  # of the step of colour beside a pixel, its noise where places are a bit off
_HIDDEN = 0.3  # how often a photo does not show the place, but something before it
_NOTHING = np.float32(np.log(_HIDDEN) + UNIFORM)
_WEIGHT = 0.8  # of a photo: their mistakes are alike
_WINDOW = 3  # pixels that show the same place, as a rule
_FLAT = -1e-3  # rays that sink less do not meet the table where any photo shows it
_CLEAR = 0.01  # of a camera above a plane, in sides of the cube
Levels = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Compared:
    """A photo as it is compared: (H, W, 4), its colours and the step of colour beside a pixel."""

    camera: Camera
    levels: Levels


def above_table(photos: Sequence[SeenPhoto], table: Ground) -> list[NDArray[np.float64]]:
    """
    Return log odds, (H, W) each, that pixels show something above a table rather than the table.

    Cameras and table are in the object frame, lengths in sides of the cube. 0: nothing is told.
    """
    compared = [_compared(photo) for photo in photos]
    top = max(_LOWEST, float(np.abs(table.normal).sum()) / 2 - table.level)
    planes = [Ground(table.normal, table.level + height)
              for height in np.linspace(_LOWEST, top, _HEIGHTS)]
    return [_evidence(one, even_choice(compared[number + 1:] + compared[:number], _OTHERS), table,
                      planes) for number, one in enumerate(compared)]


def _compared(photo: SeenPhoto) -> _Compared:
    """Return a photo with the greatest step of a channel beside each pixel; NaN where unknown."""
    soft = np.asarray(cv2.GaussianBlur(photo.image, (0, 0), _BLUR), np.float32)
    step = steps(soft).max(axis=-1)
    step[~photo.known] = np.nan
    return _Compared(photo.camera, np.dstack([soft, step]).astype(np.float32))


def _evidence(one: _Compared, others: Sequence[_Compared], table: Ground, planes: Sequence[Ground]
              ) -> NDArray[np.float64]:
    """Return the log odds, (H, W), that others show what a photo's pixels do in planes above."""
    position = one.camera.position
    planes = [plane for plane in planes if plane.height(position) > _CLEAR]
    if not planes:
        return np.zeros(one.levels.shape[:2])
    rays = one.camera.ray_directions().reshape(*one.levels.shape[:2], 3)
    sinking = np.minimum(rays @ table.normal, _FLAT)
    ahead = np.zeros((len(planes), *sinking.shape), np.float32)
    for other in others:
        in_table, *in_planes = (_likelihood(one, _carried(other, one, homography))
                                for homography in _homographies(one, other, [table, *planes]))
        for height, found in enumerate(in_planes):
            ahead[height] += np.nan_to_num(found - in_table)
    ahead = _WEIGHT * np.stack([cv2.blur(each, (_WINDOW, _WINDOW)) for each in ahead])
    inside = np.stack([_is_inside(position - (plane.height(position) / sinking)[..., None] * rays)
                       for plane in planes])
    odds = logsumexp(ahead, axis=0, b=inside) - np.log(np.maximum(inside.sum(axis=0), 1))
    return np.where(inside.any(axis=0), odds, 0.0)


def _is_inside(places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which places, (..., 3), are in the cube."""
    return np.asarray((np.abs(places) <= 0.5).all(axis=-1))


def _likelihood(one: _Compared, shown: Levels) -> Levels:
    """Return the log density of a photo's colours, (H, W), by another's; NaN where not shown."""
    apart = one.levels - shown
    step = np.maximum(one.levels[..., 3], shown[..., 3])
    apart[..., 3] = 0
    variance = 2 * _NOISE ** 2 + (_OF_STEP * step) ** 2
    density = -0.5 * (np.einsum('hwc,hwc->hw', apart, apart) / variance
                      + 3 * np.log(2 * np.pi * variance))
    return np.asarray(np.maximum(np.log(1 - _HIDDEN) + density, _NOTHING), np.float32)


def _carried(other: _Compared, one: _Compared, homography: NDArray[np.float64]) -> Levels:
    """Return what another photo shows where a photo's pixels do, (H, W, 4); NaN for nothing."""
    height, width = one.levels.shape[:2]
    shown = cv2.warpPerspective(
        other.levels, homography, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT, borderValue=(0, 0, 0, np.nan))
    across, down, least = homography[2]
    if least + min(0, across) * width + min(0, down) * height <= 0:  # some are behind the other
        rows, columns = np.ogrid[:height, :width]
        shown[across * columns + down * rows + least <= 0] = np.nan
    return np.asarray(shown, np.float32)


def _homographies(one: _Compared, other: _Compared, planes: Sequence[Ground]
                  ) -> list[NDArray[np.float64]]:
    """
    Return the homographies, (3, 3), from indices of a photo's pixels to another's by each plane.

    Hartley and Zisserman, Multiple View Geometry, eq. 13.2. The planes have one normal.
    """
    other_from_one = np.linalg.inv(other.camera.pose) @ one.camera.pose
    ray, pixel = np.linalg.inv(_by_index(one.camera.intrinsics)), _by_index(
        other.camera.intrinsics)
    turned = pixel @ other_from_one[:3, :3] @ ray
    moved = np.outer(pixel @ other_from_one[:3, 3],
                     planes[0].normal @ one.camera.pose[:3, :3] @ ray)
    return [turned - moved / float(plane.height(one.camera.position)) for plane in planes]


def _by_index(lens: Intrinsics) -> NDArray[np.float64]:
    """Return a lens's matrix, (3, 3), for indices of pixels, whose centres are whole numbers."""
    matrix = lens.matrix.copy()
    matrix[:2, 2] -= 0.5
    return matrix
