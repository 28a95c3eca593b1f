"""
Silhouettes in photos, found together with the cells that they agree on.

Each pixel is the object's or not by three witnesses: whether the board agrees with its place, if
that is known, or what a segmenter says; its colour, beside those of the object and of the rest;
and the other photos, in which a cell along its ray has to be the object too. Franco and Boyer,
"Fusion of multi-view silhouette cues using a space occupancy grid", ICCV 2005. Neighbours without
an edge between them are alike, as in `random_walker`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from active_recon.geometry.cameras import Camera
from active_recon.geometry.framing import cube_corners
from active_recon.photos.board_print import SeenBoard, UNIFORM
from active_recon.photos.cube import Cube
from active_recon.photos.ground import BOARD_GROUND
from active_recon.photos.random_walker import smoothed, Ties
from active_recon.photos.seen_photo import SeenPhoto
from active_recon.volumes.voxels import cell_centers
import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

CELLS = 48
_BINS = 16
_ROUNDS = 3
_MOST = 4.0  # log odds of a pixel by its own witnesses
_SURE = 2.0
_EXCLUDED = -6.0
_LEAST_SHARE = 0.01  # a segmenter is never surer
_SEEN, _ELSEWHERE = 0.95, 0.7  # how often a cell shows object: where it is one, where it is none
_BEYOND = 0.3  # weight of a photo for a cell that it shows beyond the board
_OTHER_COLORS = 0.3
_EDGE = 18.0  # difference of neighbours, grey levels
_TIES = 3.0  # of neighbours without an edge, relative to a pixel's own witnesses
_FEWEST = 500  # pixels that tell the colours of the rest
_LEAST_COVERED = 0.005  # of the board in all photos; less is dust and noise
_SEGMENTED_SHARE = 0.6  # of the photos that have to show a cell as the object
Logits = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Place:
    """
    Where a photo shows a cube and its cells.

    - down, across: the pixel of each cell's centre, (S^3,); shown: whether the photo has it
    - outline: (H, W) bool, the cells that may be occupied; box: around the cube's outline
    - closed: a disc that closes the gaps between centres; touched: one of the size of a cell
    """

    down: NDArray[np.intp]
    across: NDArray[np.intp]
    shown: NDArray[np.bool_]
    outline: NDArray[np.bool_]
    box: tuple[slice, slice]
    closed: NDArray[np.uint8]
    touched: NDArray[np.uint8]


def silhouettes(photos: Sequence[SeenBoard], cube: Cube, least_share: float
                ) -> tuple[list[NDArray[np.float32]], NDArray[np.bool_]]:
    """
    Return the object's share in each pixel, (H, W) in [0, 1] each, and its cells, (S, S, S).

    A cell has to show the object in `least_share` of the photos, the more so where another one
    shows the board through it. Nothing is found outside of the cube or below the board.
    """
    above = BOARD_GROUND.above(cube, CELLS).ravel()
    places = [_place(cube.camera(photo.camera, 1.0), above) for photo in photos]
    sure = [place.outline & (photo.known & (UNIFORM - photo.fit > _SURE))
            for photo, place in zip(photos, places, strict=True)]
    outside = [~photo.known & ~place.outline for photo, place in zip(photos, places, strict=True)]
    if sum(int(part.sum()) for part in outside) < _FEWEST:
        outside = [~photo.known for photo in photos]
    if sum(int(part.sum()) for part in sure) < _LEAST_COVERED * sum(
            int(photo.known.sum()) for photo in photos):
        return ([np.zeros(photo.known.shape, np.float32) for photo in photos],
                np.zeros((CELLS,) * 3, np.bool_))

    def by_board(found: Sequence[NDArray[np.float32]]) -> list[Logits]:
        return _by_color(photos, [share > 0.7 for share in found],
                         [~photo.known & (share < 0.3)
                          for photo, share in zip(photos, found, strict=True)])

    found, total = _agreed(photos, places, _by_color(photos, sure, outside), by_board, least_share)
    return found, ((total > 0) & above).reshape((CELLS,) * 3)


def segmented_silhouettes(photos: Sequence[SeenPhoto], shares: Sequence[NDArray[np.float32]],
                          above: NDArray[np.bool_] | None = None,
                          evidence: Sequence[Logits] | None = None
                          ) -> tuple[list[NDArray[np.float32]], NDArray[np.bool_]]:
    """
    Return the object's share in each pixel, (H, W) in [0, 1] each, and its cells, (S, S, S).

    `shares` are those of a segmenter. The cameras are in the object frame, lengths in sides of the
    cube. Pixels that are not `known`, which the camera did not see, tell nothing. Only the cells
    `above` a ground may be the object; None: all may. `evidence` are further log odds of each
    pixel, (H, W) each.
    """
    may_be = np.full(CELLS ** 3, True) if above is None else above.ravel()
    places = [_place(photo.camera, may_be) for photo in photos]
    places = [replace(place, shown=place.shown & photo.known[place.down, place.across])
              for photo, place in zip(photos, places, strict=True)]
    sure = [share.clip(_LEAST_SHARE, 1 - _LEAST_SHARE) for share in shares]
    logits = [np.log(share / (1 - share)) for share in sure]
    if evidence is not None:
        logits = [logit + np.clip(further, -_MOST, _MOST)
                  for logit, further in zip(logits, evidence, strict=True)]

    def by_both(found: Sequence[NDArray[np.float32]]) -> list[Logits]:
        of_object, of_rest = (_colors(photos, [part & photo.known for part, photo in zip(
            parts, photos, strict=True)]) for parts in (
                [share > 0.7 for share in found], [share < 0.3 for share in found]))
        return [np.where(photo.known, np.clip(
            logit + np.clip(_density(of_object, photo.even) - _density(of_rest, photo.even),
                            -_MOST, _MOST), -_MOST, _MOST), 0.0)
            for photo, logit in zip(photos, logits, strict=True)]

    found, total = _agreed(photos, places, by_both(shares), by_both, _SEGMENTED_SHARE)
    return found, ((total > 0) & may_be).reshape((CELLS,) * 3)


def _agreed(photos: Sequence[SeenPhoto], places: Sequence['_Place'], own: list[Logits],
            own_by: Callable[[Sequence[NDArray[np.float32]]], list[Logits]], least_share: float
            ) -> tuple[list[NDArray[np.float32]], Logits]:
    """
    Return the shares, (H, W) each, that photos and cells agree on, and the cells' log odds (S^3,).

    `own` are the log odds of pixels by their photo alone, and `own_by` those by shares found.
    """
    doubt = -least_share * len(photos) * np.log(_SEEN / _ELSEWHERE)
    others: list[Logits] = [np.zeros(photo.known.shape) for photo in photos]
    ties = [_ties(photo, place.box) for photo, place in zip(photos, places, strict=True)]
    for _ in range(_ROUNDS):
        found = [_smooth(tied, np.where(place.outline, mine + theirs, _EXCLUDED), place.box)
                 for tied, place, mine, theirs in zip(ties, places, own, others, strict=True)]
        votes = [_votes(photo, place, share)
                 for photo, place, share in zip(photos, places, found, strict=True)]
        total = np.sum(votes, axis=0) + doubt
        others = [_along_rays(total - mine, place, photo.known.shape)
                  for photo, place, mine in zip(photos, places, votes, strict=True)]
        own = own_by(found)
    return found, total


def _place(camera: Camera, above: NDArray[np.bool_]) -> _Place:
    """Return where a camera, lengths in sides of the cube, shows its cells that are `above`."""
    lens = camera.intrinsics
    pixels, depth = camera.project(cell_centers(CELLS))
    at = np.nan_to_num(np.floor(pixels), nan=-1)
    shown = (above & (depth > 0) & ((at >= 0) & (at < [lens.width, lens.height])).all(axis=1))
    across, down = np.where(shown[:, None], at, 0).astype(np.intp).T
    cell = lens.fx / camera.distance / CELLS  # pixels
    closed, touched = (np.asarray(cv2.getStructuringElement(
        cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2), np.uint8)
        for reach in (math.ceil(cell), round(cell / 2)))
    drawn = np.zeros((lens.height, lens.width), np.uint8)
    drawn[down[shown], across[shown]] = 1
    outline = cv2.morphologyEx(drawn, cv2.MORPH_CLOSE, closed) > 0
    corners, before = camera.project(cube_corners())
    first, last = ((corners.min(axis=0) - 2, corners.max(axis=0) + 2) if before.min() > 0
                   else (np.zeros(2), np.array([lens.width, lens.height])))  # inside, or beside it
    left, top = np.clip(first, 0, [lens.width - 1, lens.height - 1]).astype(int)
    right, bottom = np.clip(last, [left + 1, top + 1], [lens.width, lens.height]).astype(int)
    return _Place(down, across, shown, np.asarray(outline),
                  (slice(top, bottom), slice(left, right)), closed, touched)


def _by_color(photos: Sequence[SeenBoard], inside: Sequence[NDArray[np.bool_]],
              outside: Sequence[NDArray[np.bool_]]) -> list[Logits]:
    """Return the log odds of each pixel, (H, W) each, by examples of object and of the rest."""
    of_object = _colors(photos, inside)
    of_rest = _colors(photos, outside)
    return [np.clip(_density(of_object, photo.even)
                    - np.where(photo.known, photo.fit, _density(of_rest, photo.even)),
                    -_MOST, _MOST) for photo in photos]


def _colors(photos: Sequence[SeenPhoto], parts: Sequence[NDArray[np.bool_]]
            ) -> NDArray[np.float64]:
    """Return how often each colour is in parts of photos, (16, 16, 16), sum 1; 0 if empty."""
    counts = np.zeros(_BINS ** 3)
    for photo, part in zip(photos, parts, strict=True):
        counts += np.bincount(_bins(photo.even[part]), minlength=len(counts))
    return np.asarray(gaussian_filter(counts.reshape((_BINS,) * 3), 0.7) / max(counts.sum(), 1.0))


def _density(shares: NDArray[np.float64], image: NDArray[np.float32]) -> Logits:
    """Return the log density of each pixel's colour, (H, W): any colour is possible."""
    known = shares.ravel()[_bins(image)] * (_BINS / 256) ** 3
    return np.asarray(np.log((1 - _OTHER_COLORS) * known + _OTHER_COLORS * np.exp(UNIFORM)))


def _bins(colors: NDArray[np.float32]) -> NDArray[np.intp]:
    levels = (colors * (_BINS / 256)).astype(np.intp).clip(0, _BINS - 1)
    return np.asarray((levels[..., 0] * _BINS + levels[..., 1]) * _BINS + levels[..., 2])


def _votes(photo: SeenPhoto, place: _Place, share: NDArray[np.float32]) -> Logits:
    """Return the log odds by one photo that the object touches cells, (S^3,)."""
    shown = cv2.dilate(share, place.touched)[place.down, place.across]
    odds = np.log((_SEEN * shown + (1 - _SEEN) * (1 - shown))
                  / (_ELSEWHERE * shown + (1 - _ELSEWHERE) * (1 - shown)))
    weight = np.where(photo.known[place.down, place.across], 1.0, _BEYOND)
    return np.asarray(np.where(place.shown, odds * weight, 0.0))


def _along_rays(odds: Logits, place: _Place, shape: tuple[int, ...]) -> Logits:
    """Return the greatest log odds of the cells behind each pixel, (H, W), at most 0."""
    drawn = np.full(shape, _EXCLUDED, np.float32)
    np.maximum.at(drawn, (place.down[place.shown], place.across[place.shown]),
                  np.clip(odds[place.shown], _EXCLUDED, 0).astype(np.float32))
    return np.asarray(cv2.morphologyEx(drawn, cv2.MORPH_CLOSE, place.closed), np.float64)


def _ties(photo: SeenPhoto, box: tuple[slice, slice]) -> Ties:
    """
    Return how alike neighbours in a box of pixels are.

    An edge that the board has there too is none.
    """
    image, expected, known = photo.image[box], photo.expected[box], photo.known[box]
    found = []
    for axis in (1, 0):
        step = np.diff(image, axis=axis)
        apart = (step ** 2).sum(axis=-1)
        unprinted = ((step - np.diff(expected, axis=axis)) ** 2).sum(axis=-1)
        both = np.logical_and(*(np.delete(known, end, axis) for end in (0, -1)))
        apart = np.where(both, np.minimum(apart, unprinted), apart)
        found.append((_TIES * (np.exp(-apart / (2 * _EDGE ** 2)) + 0.01)).astype(np.float32))
    return Ties(*found)


def _smooth(ties: Ties, logits: Logits, box: tuple[slice, slice]) -> NDArray[np.float32]:
    """Return the object's share in each pixel, (H, W), alike in neighbours; 0 outside of a box."""
    own = (1 / (1 + np.exp(-np.clip(logits[box], -_MOST, _MOST)))).astype(np.float32)
    found = np.zeros(logits.shape, np.float32)
    found[box] = np.clip(smoothed(ties, own, np.abs(2 * own - 1) + np.float32(0.02)), 0, 1)
    return found
