"""What in an image is the object: by a mask, an image of the empty scene, or a colour key."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.errors import ConfigError, ViewError
import cv2
import numpy as np
from numpy.typing import NDArray

BACKGROUNDS = ('as_is', 'mask', 'reference', 'color')
"""Left as it is; from a mask; from an image of the empty scene; from the background's colour."""
COLOR_TOLERANCE = 10.0
"""A colour this near to a shade of the background's is background, CIE76 units of L*a*b*."""
GREEN_SCREEN = (0, 177, 64)
"""Red, green and blue of the usual cloth."""

_SEARCHED_SIDE = 1024  # pixels: in a larger image the object is found on a smaller one
_STANDS_OUT = 7.0  # units of L*a*b*: above the noise of a camera
_SHADOW_DISCOUNT = 0.7  # a shadow changes the lightness alone, an object mostly the colour too
_SHADES = 0.4, 1.6  # the background's brightness in the weakest and the strongest light
_EDGE = 0.35  # of what its neighbours stand out: less is a pixel that shows a bit of the object
_SMALLEST_PART = 0.02  # of the object's largest part; smaller ones are noise
_LARGEST_HOLE = 0.005  # of the object; through a larger one the background is seen
WHOLE_SHARE = 0.7
"""Less than this in one part (see `main_part_share`) is worth a warning."""
_SMALLEST_OBJECT, _LARGEST_OBJECT = 0.0005, 0.95  # of the image


@dataclass(frozen=True)
class Background:
    """
    How the object is separated from its background: one of `BACKGROUNDS`.

    `color` (red, green, blue, 0 to 255) and `tolerance` are of the colour key. Raises ConfigError
    where one of them cannot be used.
    """

    how: str = 'as_is'
    color: tuple[int, ...] = GREEN_SCREEN
    tolerance: float = COLOR_TOLERANCE

    def __post_init__(self) -> None:
        """Reject a word that is none of them, and a colour that is no colour."""
        if self.how not in BACKGROUNDS:
            raise ConfigError('background: unknown value: expected one of '
                              f'{", ".join(BACKGROUNDS)}, got {self.how!r}')
        check_color(self.color, self.tolerance)

    def cleared(self, image: NDArray[np.uint8], mask: NDArray[np.bool_] | None = None,
                reference: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """
        Return an image, (H, W, 3) uint8 RGB, with its background white; `as_is`: as it is.

        `mask` is (H, W), `reference` an image of the empty scene, (H, W, 3). Raises ViewError
        where the one that is needed is missing, and as the functions below do.
        """
        if self.how == 'as_is':
            return image
        if self.how == 'color':
            return on_white(image, off_color(image, self.color, self.tolerance))
        if self.how == 'mask':
            if mask is None:
                raise ViewError("no mask: expected a mask of the image's stamp, got none",
                                'no_mask')
            return on_white(image, mask)
        if reference is None:
            raise ViewError('no image of the empty scene: expected one before the first view, '
                            'got none; empty the scene and call '
                            'capture_background', 'no_reference')
        return on_white(image, off_reference(image, reference))


def main_part_share(cleared: NDArray[np.uint8]) -> float:
    """
    Return the share of the largest connected part in what is not white, in (0, 1].

    Far below 1 where parts of the object were taken for background: an object of the background's
    colour falls to pieces.
    """
    _, areas = _parts(np.asarray((cleared < 255).any(axis=2)))
    return float(areas.max(initial=0) / max(areas.sum(), 1))


def check_color(color: Sequence[int], tolerance: float) -> None:
    """Raise ConfigError where a colour key, as of `off_color`, cannot be used."""
    if len(color) != 3 or not all(0 <= value <= 255 for value in color) or not any(color):
        raise ConfigError('background_color: not a usable color: expected red, green and blue, '
                          f'each from 0 to 255 and one above 0, got {list(color)}')
    if not 0 < tolerance < np.inf:
        raise ConfigError('background_tolerance: out of range: expected a number above 0, got '
                          f'{tolerance}')


def on_white(image: NDArray[np.uint8], mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """
    Return an image, (H, W, 3) uint8 RGB, white where the mask, (H, W), says background.

    Raises ViewError where the mask is of another size, or has no object at all.
    """
    if mask.shape != image.shape[:2]:
        raise ViewError(f"wrong mask size: expected the image's size, {_size(image)}, "
                        f'got {_size(mask)}', 'mask')
    if not mask.any():
        raise ViewError('empty mask: expected a mask with an object, got one that is all '
                        'background', 'no_object')
    white = np.full_like(image, 255)
    return np.asarray(cv2.copyTo(image, mask.view(np.uint8), white), np.uint8)


def off_reference(image: NDArray[np.uint8], reference: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """
    Return where an image shows what the reference, the empty scene, does not, (H, W).

    Both are (H, W, 3) uint8 RGB of one size. Raises ViewError where they are not, where nothing
    stands out from the reference, and where all but everything does.
    """
    if image.shape != reference.shape:
        raise ViewError(f"wrong image size: expected the reference's size, {_size(reference)}, "
                        f'got {_size(image)}; empty the scene and call capture_background again',
                        'reference')
    apart = _apart(_smoothed(_searched(image)), _smoothed(_searched(reference)), _SHADOW_DISCOUNT)
    return _object(apart, _STANDS_OUT, image, 'the empty scene; where '
                   'camera or light have changed, empty it and call capture_background again')


def off_color(image: NDArray[np.uint8], color: Sequence[int],
              tolerance: float = COLOR_TOLERANCE) -> NDArray[np.bool_]:
    """
    Return where an image, (H, W, 3) uint8 RGB, is of another colour than its background, (H, W).

    `color` is the background's red, green and blue, each 0 to 255. Light falls unevenly, so each
    pixel is compared with that shade of the colour, 0.4 to 1.6 times as bright, which is nearest
    to it: what is within `tolerance` (CIE76 units of L*a*b*) is background. Raises ConfigError
    where colour or tolerance cannot be used, ViewError where nothing stands out from the colour
    and where all but everything does.
    """
    check_color(color, tolerance)
    pixels = _smoothed(_searched(image))
    key = np.asarray(color, np.float32)
    brightness = np.clip(pixels.astype(np.float32) @ (key / (key @ key)), *_SHADES)
    shade = cv2.merge([cv2.convertScaleAbs(brightness, alpha=float(value)) for value in key])
    apart = _apart(pixels, np.asarray(shade, np.uint8))
    return _object(apart, tolerance, image, f'the color {list(color)}; see the parameters '
                   'background_color and background_tolerance')


def _searched(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    shrink = _SEARCHED_SIDE / max(image.shape[:2])
    if shrink >= 1:
        return image
    small = cv2.resize(image, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def _smoothed(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0.6), np.uint8)


def _apart(a: NDArray[np.uint8], b: NDArray[np.uint8], of_lightness: float = 1.0
           ) -> NDArray[np.float32]:
    """Return the distance of two images' colours, (H, W), in units of L*a*b*."""
    lab = (cv2.cvtColor(image, cv2.COLOR_RGB2Lab) for image in (a, b))
    lightness, green_red, blue_yellow = (
        plane.astype(np.float32) for plane in cv2.split(cv2.absdiff(*lab)))
    lightness *= of_lightness * 100 / 255  # of bytes, OpenCV's L* goes to 255
    return np.asarray(cv2.magnitude(cv2.magnitude(green_red, blue_yellow), lightness), np.float32)


def _object(apart: NDArray[np.float32], threshold: float, image: NDArray[np.uint8],
            background: str) -> NDArray[np.bool_]:
    """Return the object's parts, cleaned and in the image's size, of how far pixels stand out."""
    around = np.asarray(cv2.dilate(apart, np.ones((3, 3), np.uint8)))
    found = (apart > threshold) & (apart > _EDGE * around)
    labels, areas = _parts(found)
    parts = (areas >= _SMALLEST_PART * areas.max(initial=0))[labels] & found
    labels, areas = _parts(~parts)
    parts |= (areas < _LARGEST_HOLE * parts.sum())[labels]
    share = float(parts.mean())
    if share < _SMALLEST_OBJECT:
        raise ViewError('no object found: expected one that stands out, but nothing does from '
                        f'{background}', 'no_object')
    if share > _LARGEST_OBJECT:
        raise ViewError('no background found: expected some around the object, but all of the '
                        f'image stands out from {background}', 'no_background')
    if parts.shape != image.shape[:2]:
        height, width = image.shape[:2]
        parts = np.asarray(cv2.resize(parts * np.uint8(255), (width, height)) > 127)
    return np.asarray(parts, np.bool_)


def _parts(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return each pixel's part, (H, W), 0 for none, and the area of each, that of none 0."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray(labels, np.int32), np.asarray(areas, np.int32)


def _size(image: NDArray[np.uint8] | NDArray[np.bool_]) -> str:
    return f'{image.shape[0]} x {image.shape[1]}'
