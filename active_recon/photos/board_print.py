"""A printed board as a camera sees it, and how well each pixel of a photo agrees with that."""

from dataclasses import dataclass
from functools import lru_cache

from active_recon.calibration.board import Board
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.photos.seen_photo import SeenPhoto
import cv2
import numpy as np
from numpy.typing import NDArray

UNIFORM = -3 * float(np.log(256))
"""Logarithm of the density of a colour, 1 / grey level^3, of which nothing is known."""
_PIXELS_PER_MM = 2.0
_SAMPLES = 2  # of the print in each direction of a pixel
_TOLERATED = (0.35, 0.2, 0.12)  # of the difference of paper and ink, in each round of the fit
_NEXT = np.ones((3, 3), np.uint8)
_SQUARES = (0.05, 0.95)  # print below and above which a pixel is ink or paper alone
_SHADOW = 0.6  # of the light that a shadow leaves on the paper, at least
_BRIGHTER = 1.05
_ON_INK = 0.35  # tolerance on ink relative to that on paper: light changes it less
_UNCOVERED = 20  # percent of ink and of paper that an object leaves free, at least
_ASIDE = (0.15, 0.6)  # pixels by which the print may be aside or blurred
_BLURS = (0.5, 0.8, 1.2, 1.8)  # pixels, of photos that are not sharp
_LEAST_NOISE = 2.0  # grey levels
_UNEVEN = 0.04  # of the expected brightness
_OTHER = 0.02  # share of the board's pixels that look like anything: dust, glare
_WHITE = 200.0


@dataclass(frozen=True, eq=False)
class SeenBoard(SeenPhoto):
    """
    A photo of a board, reduced to the size at which it is searched.

    - camera: in the board's world, whose z = 0 is the printed face and z points up
    - even: with the paper at one grey level in all photos
    - known: where the board is; expected: the board there
    - fit: (H, W) log density of the pixel's colour if the board is seen there, 0 elsewhere
    """

    fit: NDArray[np.float32]


def seen_board(image: NDArray[np.uint8], camera: Camera, board: Board, side: int) -> SeenBoard:
    """
    Return how an image, (H, W, 3) uint8 RGB, agrees with the board, at a longer side of `side`.

    Ink, paper, and the light on both are fitted, and so is the noise. Paper in a shadow agrees.
    """
    shrink = min(1.0, side / max(image.shape[:2]))
    rows, columns = (max(1, round(count * shrink)) for count in image.shape[:2])
    # Of factors instead of a size OpenCV would leave out the rest of a pixel at the end
    small = np.asarray(cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA),
                       np.float32)
    camera = Camera(camera.pose, camera.intrinsics.resized(columns, rows))
    printed, known = _printed(camera, board)
    if not known.any():
        none = np.zeros((rows, columns), np.float32)
        return SeenBoard(camera, small, small, known, small, none)
    ink, paper = _light(small, printed, known)
    edges = known & (steps(printed) > _TOLERATED[0])
    printed = _as_sharp(printed, small, ink, paper, edges)
    expected = ink + printed[..., None] * (paper - ink)
    flat = known & (steps(printed) < 1 - _SQUARES[1])
    noise = [max(_LEAST_NOISE, 1.48 * float(np.median(values))) if len(values) else _LEAST_NOISE
             for values in np.abs(small - expected)[flat].T]
    apart = _apart(small, ink, expected)
    step = steps(expected)
    aside = np.median((np.abs(apart) / np.maximum(step, 1)).max(-1)[edges]) if edges.any() else 0
    variance = (np.array(noise) ** 2 + (np.clip(1.5 * aside, *_ASIDE) * step) ** 2
                + (_UNEVEN * expected) ** 2)
    density = -0.5 * (apart ** 2 / variance + np.log(2 * np.pi * variance)).sum(axis=-1)
    fit = np.logaddexp(np.log(1 - _OTHER) + density, np.log(_OTHER) + UNIFORM)
    even = np.clip(small * _WHITE / np.maximum(np.median(paper[known], axis=0), 1), 0, 255)
    return SeenBoard(camera, small, even.astype(np.float32), known,
                     expected.astype(np.float32), np.where(known, fit, 0).astype(np.float32))


def _as_sharp(printed: NDArray[np.float32], image: NDArray[np.float32], ink: NDArray[np.float32],
              paper: NDArray[np.float32], edges: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the print, (H, W), blurred as the image fits it best at the edges of squares."""
    if not edges.any():
        return printed
    blurred = [printed, *(cv2.GaussianBlur(printed, (0, 0), sigma) for sigma in _BLURS)]
    apart = [float(np.median(np.abs(image - ink - each[..., None] * (paper - ink))[edges]))
             for each in blurred]
    return np.asarray(blurred[int(np.argmin(apart))], np.float32)


def _apart(image: NDArray[np.float32], ink: NDArray[np.float32], expected: NDArray[np.float32]
           ) -> NDArray[np.float32]:
    """Return image minus board, (H, W, 3), the board under the shadow that fits best."""
    over_ink = np.maximum(expected - ink, 0)
    share = ((image - ink) * over_ink).sum(-1) / np.maximum((over_ink ** 2).sum(-1), 1)
    return np.asarray(image - ink - np.clip(share, _SHADOW, _BRIGHTER)[..., None] * over_ink)


def _light(image: NDArray[np.float32], printed: NDArray[np.float32], known: NDArray[np.bool_]
           ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return ink and paper as they look in the light at each pixel, (H, W, 3) each."""
    rows, columns = known.shape
    down, across = np.mgrid[-1:1:rows * 1j, -1:1:columns * 1j].astype(np.float32)
    linear = np.stack([np.ones_like(down), across, down], axis=-1)
    curved = np.stack([across * down, across ** 2, down ** 2], axis=-1)
    whole = np.concatenate([linear, curved], axis=-1)
    terms = np.concatenate([printed[..., None] * whole, (1 - printed[..., None]) * linear], -1)
    inks, papers = np.empty_like(image), np.empty_like(image)
    for channel in range(3):
        shown = image[..., channel]
        first, last = (float(np.percentile(shown[part], rank)) if part.any() else level
                       for part, rank, level in (
                           (known & (printed < _SQUARES[0]), _UNCOVERED, 0.0),
                           (known & (printed > _SQUARES[1]), 100 - _UNCOVERED, 255.0)))
        tolerated = (_ON_INK + (1 - _ON_INK) * printed) * max(last - first, 1.0)
        inks[..., channel], papers[..., channel] = first, last
        expected = first + printed * (last - first)
        for share in _TOLERATED:
            fitting = known & (np.abs(shown - expected) < share * tolerated)
            if fitting.sum() > 2 * terms.shape[-1]:
                weights = np.linalg.lstsq(terms[fitting], shown[fitting], rcond=None)[0]
                expected = terms @ weights
                inks[..., channel] = linear @ weights[whole.shape[-1]:]
                papers[..., channel] = whole @ weights[:whole.shape[-1]]
    return inks, papers


def steps(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return how far values, (H, W) or (H, W, C), next to each pixel are apart, of that shape."""
    return np.asarray(cv2.dilate(values, _NEXT) - cv2.erode(values, _NEXT), np.float32)


@lru_cache(maxsize=1)
def _optical_rays(lens: Intrinsics) -> NDArray[np.float64]:
    """Return the rays of a lens in the optical frame, (H, W, 3): photos share their lens."""
    return Camera(np.eye(4), lens).ray_directions()


def _printed(camera: Camera, board: Board) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """
    Return the board's print in [0, 1] as a camera sees it, (H, W), and where it is.

    Pixels on the board's rim, which also show what is beside it, are not there.
    """
    lens = camera.intrinsics
    finer = lens.resized(_SAMPLES * lens.width, _SAMPLES * lens.height)
    rays = _optical_rays(finer) @ camera.pose[:3, :3].T
    with np.errstate(divide='ignore', invalid='ignore'):
        away = np.where(rays[..., 2] < 0, -camera.position[2] / rays[..., 2], np.nan)
        x = camera.position[0] + away * rays[..., 0]
        y = -(camera.position[1] + away * rays[..., 1])  # the board's own y points the other way
        wide, high = board.columns * board.square, board.rows * board.square
        there = (x > 0) & (x < wide) & (y > 0) & (y < high)
    drawn = cv2.GaussianBlur(board.drawn(_PIXELS_PER_MM), (0, 0), 1.0).astype(np.float32) / 255
    scale = drawn.shape[1] / wide
    across, down = (np.where(there, axis * scale - 0.5, -1).astype(np.float32) for axis in (x, y))
    fine = cv2.remap(drawn, across, down, cv2.INTER_LINEAR)
    size = lens.width, lens.height
    whole = cv2.resize(there.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 1 - 1e-3
    known = cv2.erode(whole.astype(np.uint8), _NEXT, borderValue=1) > 0
    return (np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), np.float32),
            np.asarray(known))
