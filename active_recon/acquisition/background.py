"""Background removal by a segmenter, a mask, an image of the empty scene, or a colour key."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.errors import ConfigError, ViewError
import cv2
import numpy as np
from numpy.typing import NDArray

Segmented = Callable[[NDArray[np.uint8]], NDArray[np.uint8]]
BACKGROUNDS = ('as_is', 'segment', 'mask', 'reference', 'color')
"""
No removal; by a segmenter; by a mask; by an image of the empty scene; by the background's colour.
"""
COLOR_TOLERANCE = 10.0
"""Largest distance of a background pixel from the background's colour, CIE76 in L*a*b*."""
GREEN_SCREEN = (0, 177, 64)
_WHITE = (255, 255, 255)
"""Red, green and blue of a common green screen."""

_SEARCHED_SIDE = 1024  # pixels: larger images are downsampled to find the object
_STANDS_OUT = 7.0  # distance in L*a*b*: above the noise of a camera
_SHADOW_DISCOUNT = 0.7  # weight of lightness, since shadows change it and hardly the colour
_SHADES = 0.4, 1.6  # brightness of the background in the weakest and the strongest light
_EDGE = 0.35  # fraction of the neighbours' distance; below it a pixel is mostly background
_SMALLEST_PART = 0.02  # area relative to the object's largest part; smaller ones are noise
_LARGEST_HOLE = 0.005  # area relative to the object; larger holes show the background
WHOLE_SHARE = 0.7
"""There is a warning if `main_part_share` is below this."""
_SMALLEST_OBJECT, _LARGEST_OBJECT = 0.0005, 0.95  # area relative to the image


@dataclass(frozen=True)
class Background:
    """
    The method that separates the object from its background: `how` is one of `BACKGROUNDS`.

    `color` (red, green, blue, 0 to 255) and `tolerance` (CIE76) are for the colour key. Raises
    ConfigError on invalid values.
    """

    how: str = 'as_is'
    color: tuple[int, ...] = GREEN_SCREEN
    tolerance: float = COLOR_TOLERANCE

    def __post_init__(self) -> None:
        """Reject unknown methods and invalid colours."""
        if self.how not in BACKGROUNDS:
            raise ConfigError('background: unknown value: expected one of '
                              f'{", ".join(BACKGROUNDS)}, got {self.how!r}')
        check_color(self.color, self.tolerance)

    def cleared(self, image: NDArray[np.uint8], mask: NDArray[np.bool_] | None = None,
                reference: NDArray[np.uint8] | None = None,
                segmented: Segmented | None = None) -> NDArray[np.uint8]:
        """
        Return an image, (H, W, 3) uint8 RGB, with a white background; unchanged for `as_is`.

        `mask` is (H, W), true on the object; `reference` is an image of the empty scene,
        (H, W, 3); `segmented` returns the image with the object that it finds on white. Raises
        ViewError where the required one is missing, and as `on_white`, `off_reference`,
        `off_color` and `segmented` do.
        """
        if self.how == 'as_is':
            return image
        if self.how == 'segment':
            if segmented is None:
                raise ViewError('no segmenter: expected one to find the object, got none',
                                'no_segmenter')
            return segmented(image)
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
    Return the fraction of the pixels that are not white in their largest connected part, [0, 1].

    It is 0 where all are white, and far below 1 where parts of the object were taken for
    background, for example because they have the same colour.
    """
    white = np.asarray(cv2.inRange(cleared, _WHITE, _WHITE), np.uint8)
    _, areas = _parts(_searched(white) < 255)
    return float(areas.max(initial=0) / max(areas.sum(), 1))


def check_color(color: Sequence[int], tolerance: float) -> None:
    """Raise ConfigError on an invalid colour or tolerance of a colour key, see `off_color`."""
    if len(color) != 3 or not all(0 <= value <= 255 for value in color) or not any(color):
        raise ConfigError('background_color: not a usable color: expected red, green and blue, '
                          f'each from 0 to 255 and one above 0, got {list(color)}')
    if not 0 < tolerance < np.inf:
        raise ConfigError('background_tolerance: out of range: expected a number above 0, got '
                          f'{tolerance}')


def on_white(image: NDArray[np.uint8], mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """
    Return an image, (H, W, 3) uint8 RGB, with white where the mask, (H, W), is false.

    Raises ViewError where the mask has another size, or is false everywhere.
    """
    if mask.shape != image.shape[:2]:
        raise ViewError(f"wrong mask size: expected the image's size, {_size(image)}, "
                        f'got {_size(mask)}', 'mask')
    if not mask.any():
        raise ViewError('empty mask: expected a mask with an object, got one that is all '
                        'background', 'no_object')
    white = np.full(image.shape, 255, np.uint8)  # OpenCV writes into no other layout
    return np.asarray(cv2.copyTo(image, mask.view(np.uint8), white), np.uint8)


def off_reference(image: NDArray[np.uint8], reference: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """
    Return the mask of the object, (H, W): the pixels that differ from the empty scene.

    Image and reference are (H, W, 3) uint8 RGB of the same size. Raises ViewError where they are
    not, and where nothing or nearly everything differs.
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
    Return the mask of the object, (H, W): the pixels that differ from the background's colour.

    The image is (H, W, 3) uint8 RGB; `color` is the background's red, green and blue, 0 to 255.
    Since light is uneven, each pixel is compared with the nearest shade of the colour, 0.4 to 1.6
    times as bright; it is background if the distance is at most `tolerance` (CIE76 in L*a*b*).
    Raises ConfigError on an invalid colour or tolerance, ViewError where nothing or nearly
    everything differs from the colour.
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
    """Return the distance between the colours of two images in L*a*b*, CIE76, (H, W)."""
    lab = (cv2.cvtColor(image, cv2.COLOR_RGB2Lab) for image in (a, b))
    lightness, green_red, blue_yellow = (
        plane.astype(np.float32) for plane in cv2.split(cv2.absdiff(*lab)))
    lightness *= of_lightness * 100 / 255  # OpenCV scales L* to 255 in 8-bit images
    return np.asarray(cv2.magnitude(cv2.magnitude(green_red, blue_yellow), lightness), np.float32)


def _object(apart: NDArray[np.float32], threshold: float, image: NDArray[np.uint8],
            background: str) -> NDArray[np.bool_]:
    """Return the object's mask without noise and holes, at the image's size, from distances."""
    around = np.asarray(cv2.dilate(apart, np.ones((3, 3), np.uint8)))
    parts = without_specks((apart > threshold) & (apart > _EDGE * around))
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


def without_specks(found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask, (H, W), without parts and holes that are small beside the object."""
    labels, areas = _parts(found)
    parts = (areas >= _SMALLEST_PART * areas.max(initial=0))[labels] & found
    labels, areas = _parts(~parts)
    return np.asarray(parts | (areas < _LARGEST_HOLE * parts.sum())[labels], np.bool_)


def _parts(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the label of each pixel's part, (H, W), 0 for none, and the areas by label."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray(labels, np.int32), np.asarray(areas, np.int32)


def _size(image: NDArray[np.uint8] | NDArray[np.bool_]) -> str:
    return f'{image.shape[1]} x {image.shape[0]}'
