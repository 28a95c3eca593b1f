"""Views of photos through the network; and the object's cube, found from what comes out."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Camera
from active_recon.photos.backgrounds import shown_image
from active_recon.photos.cube import Cube, FIT
from active_recon.photos.extent import explaining_box
from active_recon.photos.ground import Ground, no_table
from active_recon.photos.hull import ceiling, coverage, depth_in_masks, hull, seen_cells
from active_recon.photos.segmented_views import segmented_cells
from active_recon.photos.shape import TakenView
from active_recon.photos.views import even_choice, PhotoView
from active_recon.reconstructor import Reconstructor
from active_recon.segmentation import shipped_segmentation
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.object_box import object_box
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray

COVERED = 0.95
"""Share of every mask that the hull covers where masks do not contradict each other."""
_COVERED_PLAIN = 0.995  # of masks by colour: they lack what has the background's colour
Advance = Callable[[int, str], None]
SEARCHED_VIEWS = 8
_ROUNDS = 4
_HULL_CELLS = 48
_WIDER = 1.2  # than where the search begins is the cube at most, before any background
_SAME = 0.08  # relative change of the cube below which the search ends


def integrate(views: Sequence[PhotoView], cube: Cube, size: float, reconstructor: Reconstructor,
              background: str, advance: Advance = lambda steps, note: None,
              with_depth: bool = False) -> tuple[list[TakenView], list[str]]:
    """
    Return the views after each other in the reconstruction, and why others are left out.

    `size` is the side of the cube, metres, which has to be true for `with_depth`. Raises DataError
    where no view can be used, with the first reason.
    """
    reconstructor.object_size = size
    reconstructor.reset()
    taken, left_out = [], []
    for view in views:
        camera = cube.camera(view.camera, size)
        try:
            image, source = shown_image(view, camera, size, background,
                                        reconstructor.threads)
            depth = None if view.depth is None or not with_depth else DepthImage(view.depth)
            known = reconstructor.add_view(image, camera, depth)
            taken.append(TakenView(view.name, image, camera, source, known,
                                   None if known.depth_refusal else depth))
        except ViewError as error:
            left_out.append(f'{view.name}: {error}')
        advance(1, view.name)
    if not taken:
        raise DataError(f'no photo shows the object: {left_out[0]}', 'no_object')
    return taken, left_out


def carved(grid: VoxelGrid, threshold: float, views: Sequence[PhotoView],
           cube: Cube) -> tuple[VoxelGrid, float]:
    """
    Return the grid without the cells that a mask excludes, and the masks' `coverage`.

    Where masks contradict each other, only their mistakes would be cut out: the same grid is
    returned. So would those of what was told from a board, which lack what looks like the board.
    """
    views = [view for view in views if view.mask is not None and view.mask_source != 'board']
    if not views:
        return grid, 1.0
    cameras = [cube.camera(view.camera, 1.0) for view in views]
    depths = depth_in_masks(views, cameras, len(grid.occupancy))
    covered = coverage(hull(depths), views, cameras)
    plain = any(view.mask_source == 'plain' for view in views)
    if covered < (_COVERED_PLAIN if plain else COVERED):
        return grid, covered
    return VoxelGrid(np.minimum(grid.occupancy, ceiling(depths, threshold)), grid.size), covered


def above_ground(grid: VoxelGrid, threshold: float, cube: Cube, ground: Ground) -> VoxelGrid:
    """Return the grid with nothing under a ground; raises DataError where that is all there is."""
    above = ground.above(cube, len(grid.occupancy))
    kept = VoxelGrid(np.where(above, grid.occupancy, np.float32(0)), grid.size)
    if grid.occupied(threshold).any() and not kept.occupied(threshold).any():
        raise DataError('object not found: expected one above the ground, found nothing but what '
                        f'is under it{no_table(ground)}', 'no_object')
    return kept


def found_cube(views: Sequence[PhotoView], start: Cube, reconstructor: Reconstructor,
               background: str, ground: Ground | None = None) -> Cube:
    """
    Return the cube about the object, found in `start` and cut down to what is in it.

    Where every view has a mask, their hull is in it, else what the segmenter or the network finds;
    nothing under a ground is. Raises DataError where nothing is.
    """
    some = even_choice(views, SEARCHED_VIEWS)
    cube, largest = start, start.side * (1.0 if are_masked(views) else _WIDER)
    for _ in range(_ROUNDS):
        found = _found(some, cube, reconstructor, background, ground)
        before, cube = cube, cube.part(_box(object_box(found.cells), ground))
        cube = replace(cube, side=min(cube.side, largest))
        moved = float(np.linalg.norm(cube.centre - before.centre))
        if max(moved, abs(cube.side - before.side)) < _SAME * before.side:
            break
    box = explaining_box(*found, standing=ground is not None)
    return before.part(_box(box, ground), FIT)


class _Found(NamedTuple):
    """Cells of a cube, (R, R, R); and, if they are a hull, its masks and their cameras there."""

    cells: NDArray[np.bool_]
    masks: Sequence[NDArray[np.bool_]]
    cameras: Sequence[Camera]


def _found(views: Sequence[PhotoView], cube: Cube, reconstructor: Reconstructor, background: str,
           ground: Ground | None) -> _Found:
    """Return what views find in a cube; nothing under a ground."""
    cameras = [cube.camera(view.camera, 1.0) for view in views]
    masks = [view.mask for view in views if view.mask is not None]
    if len(masks) == len(views):
        found = _Found(hull(depth_in_masks(views, cameras, _HULL_CELLS)), masks, cameras)
    elif background == 'segment':
        found = _Found(*segmented_cells(
            views, cube, shipped_segmentation(reconstructor.threads), ground))
    else:
        taken, _ = integrate(views, cube, 1.0, reconstructor, background)
        found = _Found(taken[-1].known.grid.occupied(reconstructor.threshold), [], [])
    cells = found.cells
    if found.masks:
        cells = cells & seen_cells(cameras, len(cells))
    if ground is not None:
        cells = cells & ground.above(cube, len(cells))
    return found._replace(cells=cells)


def _box(box: NDArray[np.float64] | None, ground: Ground | None) -> NDArray[np.float64]:
    """Return a box that was found; raises DataError where none was."""
    if box is None:
        raise DataError('object not found: expected one where the photos look, found nothing '
                        'there; give its place by --box, or masks by --masks'
                        + no_table(ground), 'no_cube')
    return box


def are_masked(views: Sequence[PhotoView]) -> bool:
    """Return whether every view has a mask."""
    return all(view.mask is not None for view in views)
