"""
What stands on a printed board: where the board does not look as it was printed.

Where a camera and the board are known, so is the board's picture, up to ink, paper and light,
which are fitted. Beyond the board a photo alone tells nothing; there the hull does that the board
in the other photos leaves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from active_recon.acquisition.background import without_specks
from active_recon.calibration.board import Board
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.photos.cube import Cube
from active_recon.photos.hull import depth_in_masks, hull, object_box, seen_cells
from active_recon.photos.views import PhotoView
import cv2
import numpy as np
from numpy.typing import NDArray

_SEARCHED_SIDE = 640
_PIXELS_PER_MM = 2.0
_TOLERATED = (0.35, 0.2, 0.2)  # of the difference of paper and ink, in each round of the fit
_NEXT = np.ones((3, 3), np.uint8)
_CLOSED = 0.03  # width of gaps that are closed, relative to the longer side
_CELLS = 48
_ROUNDS = 2
_OF_BOARD = 1.2
_LEAST_SHARE = 0.4  # of the photos that show a cell over the board: others cannot tell
_ASIDE = 0.35  # pixels by which the print may be aside
_SQUARES = (0.05, 0.95)  # print below and above which a pixel is ink or paper alone


@dataclass(frozen=True, eq=False)
class Evidence:
    """Where a photo shows the board's place, and where something covers it, (H, W) bool each."""

    known: NDArray[np.bool_]
    covered: NDArray[np.bool_]


def board_evidence(image: NDArray[np.uint8], camera: Camera, board: Board) -> Evidence:
    """
    Return where something covers the board in an image, (H, W, 3) uint8 RGB.

    The camera is in the board's world, whose z = 0 is the printed face and z points up.
    """
    height, width = image.shape[:2]
    shrink = min(1.0, _SEARCHED_SIDE / max(height, width))
    small = np.asarray(cv2.resize(image, None, fx=shrink, fy=shrink,
                                  interpolation=cv2.INTER_AREA), np.uint8)
    rows, columns = small.shape[:2]
    seen_by = Camera(camera.pose, camera.intrinsics.resized(columns, rows))
    printed, known = _printed(seen_by, board)
    if not known.any():
        return Evidence(np.zeros((height, width), np.bool_), np.zeros((height, width), np.bool_))
    reach = round(_CLOSED * max(rows, columns) / 2)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)
    other = (known & ~_as_printed(small.astype(np.float32), printed, known)).astype(np.uint8)
    covered = np.asarray(cv2.morphologyEx(cv2.morphologyEx(other, cv2.MORPH_OPEN, _NEXT),
                                          cv2.MORPH_CLOSE, disc) > 0)
    masks = (known, without_specks(covered) & known)
    return Evidence(*(np.asarray(cv2.resize(mask * np.uint8(255), (width, height)) > 127)
                      for mask in masks))


def board_views(views: Sequence[PhotoView], board: Board, cube: Cube | None
                ) -> tuple[list[PhotoView], list[str], Cube]:
    """
    Return views with masks of what stands on the board, why others are left out, and its cube.

    `cube` None: it is found, from one as wide as the board. Raises DataError where nothing stands
    there.
    """
    evidence = [board_evidence(view.image, view.camera, board) for view in views]
    rounds = 0 if cube is not None else _ROUNDS
    cube = cube or _over_board(board, views)
    for _ in range(rounds):
        masked = with_board_masks(views, evidence, cube)
        cameras = [cube.camera(view.camera, 1.0) for view in views]
        cells = hull(depth_in_masks(masked, cameras, _CELLS)) & cube.above_ground(_CELLS)
        box = object_box(cells & seen_cells(cameras, _CELLS))
        if box is None:
            raise DataError('object not found: expected one on the board, found nothing that '
                            'covers it in several photos; give its place by --box', 'no_cube')
        cube = cube.part(box)
    masked = with_board_masks(views, evidence, cube)
    empty = [f'{view.name}: nothing stands on the board in it' for view in masked
             if view.mask is not None and not view.mask.any()]
    found = [view for view in masked if view.mask is not None and view.mask.any()]
    if not found:
        raise DataError(f'object not found: {empty[0]}', 'no_object')
    return found, empty, cube


def _over_board(board: Board, views: Sequence[PhotoView]) -> Cube:
    """Return a cube that stands on the middle of the board, as wide as that."""
    wide, high = board.columns * board.square, board.rows * board.square
    middle = np.array([wide / 2, -high / 2, 0.0])
    nearest = min(float(np.linalg.norm(view.camera.position - middle)) for view in views)
    side = min(_OF_BOARD * max(wide, high), nearest)
    return Cube(middle + [0, 0, side / 2], side, np.array([0.0, 0.0, 1.0]))


def with_board_masks(views: Sequence[PhotoView], evidence: Sequence[Evidence],
                     cube: Cube) -> list[PhotoView]:
    """
    Return the views with masks of what stands on the board, in a cube.

    A pixel of the board's place is the object's if it is covered; one beyond the board is if the
    hull of what covers the board in all photos is seen there.
    """
    cameras = [cube.camera(view.camera, 1.0) for view in views]
    masks = [found.covered | ~found.known for found in evidence]
    possible = [replace(view, mask=mask, mask_source='board')
                for view, mask in zip(views, masks, strict=True)]
    cells = hull(depth_in_masks(possible, cameras, _CELLS)) & cube.above_ground(_CELLS)
    cells &= _times_covered(views, evidence, cameras) >= _LEAST_SHARE * len(views)
    return [replace(view, mask=mask & _shown(cells, camera))
            for view, mask, camera in zip(possible, masks, cameras, strict=True)]


def _times_covered(views: Sequence[PhotoView], evidence: Sequence[Evidence],
                   cameras: Sequence[Camera]) -> NDArray[np.int64]:
    """Return in how many photos each cell lies where something covers the board, (S, S, S)."""
    count = np.zeros((_CELLS,) * 3, np.int64)
    for view, found, camera in zip(views, evidence, cameras, strict=True):
        depths = depth_in_masks([replace(view, mask=found.covered)], [camera], _CELLS)
        count += hull(depths) & np.isfinite(depths)
    return count


def _shown(cells: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_]:
    """Return where a camera, lengths in sides of their cube, shows cells, (height, width)."""
    lens = camera.intrinsics
    shown = np.zeros((lens.height, lens.width), np.uint8)
    pixels, depth = camera.project((np.argwhere(cells) + 0.5) / len(cells) - 0.5)
    place = np.floor(pixels[depth > 0])
    inside = ((place >= 0) & (place < [lens.width, lens.height])).all(axis=1)
    across, down = place[inside].astype(np.intp).T
    shown[down, across] = 1
    reach = int(np.ceil(lens.fx / camera.distance / len(cells)))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)
    return np.asarray(cv2.morphologyEx(shown, cv2.MORPH_CLOSE, disc) > 0)


@lru_cache(maxsize=1)
def _optical_rays(lens: Intrinsics) -> NDArray[np.float64]:
    """Return the rays of a lens in the optical frame, (H, W, 3): photos share their lens."""
    return Camera(np.eye(4), lens).ray_directions()


def _printed(camera: Camera, board: Board) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the board's print in [0, 1] as a camera sees it, (H, W), and where it is."""
    rays = _optical_rays(camera.intrinsics) @ camera.pose[:3, :3].T
    with np.errstate(divide='ignore', invalid='ignore'):
        away = np.where(rays[..., 2] < 0, -camera.position[2] / rays[..., 2], np.nan)
        x = camera.position[0] + away * rays[..., 0]
        y = -(camera.position[1] + away * rays[..., 1])  # the board's own y points the other way
        wide, high = board.columns * board.square, board.rows * board.square
        there = (x > 0) & (x < wide) & (y > 0) & (y < high)
    drawn = cv2.GaussianBlur(board.drawn(_PIXELS_PER_MM), (0, 0), 1.0).astype(np.float32) / 255
    scale = drawn.shape[1] / wide
    across, down = (np.where(there, axis * scale - 0.5, -1).astype(np.float32) for axis in (x, y))
    return np.asarray(cv2.remap(drawn, across, down, cv2.INTER_LINEAR), np.float32), there


def _as_printed(image: NDArray[np.float32], printed: NDArray[np.float32],
                known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where an image, (H, W, 3), looks as the print does in the light that there is."""
    rows, columns = known.shape
    down, across = np.mgrid[-1:1:rows * 1j, -1:1:columns * 1j]
    light = np.stack([np.ones(known.shape), across, down], axis=-1)
    terms = np.concatenate([printed[..., None] * light, (1 - printed[..., None]) * light], -1)
    same = known.copy()
    for channel in range(3):
        shown = image[..., channel]
        ink, paper = (float(np.median(shown[part])) if part.any() else level for part, level in (
            (known & (printed < _SQUARES[0]), 0.0), (known & (printed > _SQUARES[1]), 255.0)))
        tolerated = max(paper - ink, 1.0)
        expected = ink + printed * (paper - ink)
        for share in _TOLERATED:
            fitting = known & (np.abs(shown - expected) < share * tolerated)
            if fitting.sum() > terms.shape[-1]:
                weights = np.linalg.lstsq(terms[fitting], shown[fitting], rcond=None)[0]
                expected = (terms @ weights).astype(np.float32)
        # Edges of squares are a part of a pixel aside where the pose is a little off
        step = cv2.dilate(expected, _NEXT) - cv2.erode(expected, _NEXT)
        same &= np.abs(shown - expected) < _TOLERATED[-1] * tolerated + _ASIDE * step
    return same
