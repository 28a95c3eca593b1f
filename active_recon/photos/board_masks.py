"""What stands on a printed board: its masks in all photos, and the cube about it."""

from collections.abc import Sequence
from dataclasses import replace

from active_recon.acquisition.background import without_specks
from active_recon.calibration.board import Board
from active_recon.errors import DataError
from active_recon.photos.board_print import seen_board
from active_recon.photos.cube import Cube, FIT
from active_recon.photos.extent import explaining_box
from active_recon.photos.ground import BOARD_GROUND
from active_recon.photos.hull import depth_in_masks, hull, seen_cells
from active_recon.photos.silhouette_fusion import CELLS, silhouettes
from active_recon.photos.views import PhotoView
from active_recon.volumes.object_box import object_box
import cv2
import numpy as np
from numpy.typing import NDArray

_COARSE_SIDES = (240, 300)  # of the photos in which the cube is searched, longer side, pixels
_FINE_SIDE = 400
_COARSE_SHARE = 0.3  # of the photos that have to show a cell as the object while it is searched
_FINE_SHARE = 0.6
_OF_BOARD = 1.2


def board_views(views: Sequence[PhotoView], board: Board, cube: Cube | None
                ) -> tuple[list[PhotoView], list[str], Cube]:
    """
    Return views with masks of what stands on the board, why others are left out, and its cube.

    Their cameras are in the board's world, whose z = 0 is the printed face and z points up.
    `cube` None: it is found, from one as wide as the board. Raises DataError where nothing stands
    there.
    """
    told, cube = cube is not None, cube or _over_board(board, views)
    for side in () if told else _COARSE_SIDES:
        photos = [seen_board(view.image, view.camera, board, side) for view in views]
        _, cells = silhouettes(photos, cube, _COARSE_SHARE)
        cube = _about(cells & seen_cells([cube.camera(view.camera, 1.0) for view in views],
                                         CELLS), cube)
    photos = [seen_board(view.image, view.camera, board, _FINE_SIDE) for view in views]
    shares, _ = silhouettes(photos, cube, _FINE_SHARE)
    masked = [replace(view, mask=_whole(share, view.image.shape), mask_source='board')
              for view, share in zip(views, shares, strict=True)]
    found = [view for view in masked if view.mask is not None and view.mask.any()]
    empty = [f'{view.name}: nothing stands on the board in it' for view in masked
             if view.mask is None or not view.mask.any()]
    if not found:
        raise DataError(f'object not found: {empty[0]}', 'no_object')
    if not told:
        cameras = [cube.camera(view.camera, 1.0) for view in found]
        agreed = hull(depth_in_masks(found, cameras, CELLS)) & BOARD_GROUND.above(cube, CELLS)
        box = explaining_box(agreed, [view.mask for view in found if view.mask is not None],
                             cameras, standing=True)
        cube = cube if box is None else cube.part(box, FIT)
    return found, empty, cube


def _about(cells: NDArray[np.bool_], cube: Cube) -> Cube:
    """Return the cube about the largest part of a cube's cells; raises DataError without any."""
    box = object_box(cells)
    if box is None:
        raise DataError('object not found: expected one on the board, found nothing that covers '
                        'it in several photos; give its place by --box', 'no_cube')
    return cube.part(box)


def _whole(share: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return the mask of an image of some shape by the object's share in a smaller one."""
    mask = cv2.resize(share, shape[1::-1], interpolation=cv2.INTER_LINEAR) > 0.5
    return without_specks(np.asarray(mask))


def _over_board(board: Board, views: Sequence[PhotoView]) -> Cube:
    """Return a cube that stands on the middle of the board, as wide as that."""
    wide, high = board.columns * board.square, board.rows * board.square
    middle = np.array([wide / 2, -high / 2, 0.0])
    nearest = min(float(np.linalg.norm(view.camera.position - middle)) for view in views)
    side = min(_OF_BOARD * max(wide, high), nearest)
    return Cube(middle + [0, 0, side / 2], side, np.array([0.0, 0.0, 1.0]))
