"""One picture of a run: the views around the turntable, and the occupancy after each."""

from collections.abc import Callable, Sequence
import math

from active_recon.demo.drawing import centred, PAPER, paste, QUIET, text
from active_recon.geometry.cameras import (
    azimuth_difference,
    AZIMUTHS,
    Camera,
    CANONICAL_INTRINSICS,
    orbit_camera,
    whole_degrees,
)
from active_recon.view_colors import view_color
from active_recon.viewer.view_result import ViewResult
from active_recon.volumes.boxes import height_range, voxel_picture
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray
import trimesh

TILE = 250
COLUMNS = 6
_BLOCK = 2 * TILE + 76  # a row of images over a row of occupancies, and their captions
_PLAN = 500
_MARGIN = 28
_HEADER = 84
_LOOK_FROM = math.radians(35)  # azimuth from which the occupancies are drawn


DrawVoxels = Callable[[VoxelGrid, tuple[int, int]], NDArray[np.uint8]]
"""`voxel_tile`, or what remembers its results."""


def voxel_tile(grid: VoxelGrid, heights: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the cells above 0, (TILE, TILE, 3) uint8 RGB; `heights` as in `voxel_boxes`."""
    return voxel_picture(grid, heights, _tile_camera(), PAPER)


def run_picture(title: str, views: Sequence[ViewResult], mesh: trimesh.Trimesh,
                truth: VoxelGrid, draw: DrawVoxels = voxel_tile) -> NDArray[np.uint8]:
    """
    Return the picture, (H, W, 3) uint8 RGB: left the turntable from above, right the views.

    `mesh` and `truth` are the known object, which end the row of views for comparison.
    """
    blocks = math.ceil((len(views) + 1) / COLUMNS)
    columns = min(len(views) + 1, COLUMNS)
    width = _PLAN + columns * TILE + 3 * _MARGIN
    picture = np.full((_HEADER + max(blocks * _BLOCK, _PLAN) + _MARGIN, width, 3), PAPER, np.uint8)
    text(picture, title, (_MARGIN, 50), 27)
    paste(picture, turntable_plan(views, mesh), _MARGIN, _HEADER + (_BLOCK - _PLAN) // 2)
    heights = height_range(truth)
    for index in range(len(views) + 1):
        left = _PLAN + 2 * _MARGIN + index % COLUMNS * TILE
        top = _HEADER + index // COLUMNS * _BLOCK
        if index < len(views):
            _draw_view(picture, left, top, index + 1, views[index], heights, draw)
        else:
            _draw_truth(picture, left, top, mesh, truth, heights)
    return picture


def turntable_plan(views: Sequence[ViewResult], mesh: trimesh.Trimesh) -> NDArray[np.uint8]:
    """Return the object from above amid the numbered cameras, (500, 500, 3) uint8 RGB."""
    plan = np.full((_PLAN, _PLAN, 3), PAPER, np.uint8)
    center, radius = _PLAN // 2, 156
    cv2.circle(plan, (center, center), radius, (228, 230, 235), -1, cv2.LINE_AA)
    cv2.circle(plan, (center, center), radius, (196, 200, 208), 1, cv2.LINE_AA)
    above = Renderer(mesh).render(_camera(0.0, math.radians(89.9), 1.9, 2 * radius), samples=3)
    corner = center - radius
    below = plan[corner:corner + 2 * radius, corner:corner + 2 * radius]
    paste(plan, composite(above, below), corner, corner)
    for azimuth in AZIMUTHS:
        cv2.circle(plan, _around(azimuth, radius), 2, QUIET, -1, cv2.LINE_AA)
    for before, after in zip(views, views[1:], strict=False):
        start, end = (_around(view.camera.azimuth, radius - 26) for view in (before, after))
        cv2.arrowedLine(plan, start, end, (150, 156, 168), 1, cv2.LINE_AA, tipLength=0.05)
    for number, view in reversed(list(enumerate(views, 1))):  # the first at a place is on top
        others = sum(_at_same_place(view, earlier) for earlier in views[:number - 1])
        _draw_camera(plan, number, view.camera.azimuth, radius + 34 + 14 * min(others, 3))
    return plan


def _at_same_place(view: ViewResult, other: ViewResult) -> bool:
    away = azimuth_difference(view.camera.azimuth, other.camera.azimuth)
    return bool(abs(away) < math.radians(7))


def _draw_camera(plan: NDArray[np.uint8], number: int, azimuth: float, distance: float) -> None:
    spot, color = _around(azimuth, distance), view_color(number)
    toward = [_around(azimuth + side, distance - 38) for side in (-0.11, 0.11)]
    cone = np.array([spot, *toward], np.int32)
    faint = tuple(int(0.35 * c + 0.65 * p) for c, p in zip(color, PAPER, strict=True))
    cv2.fillConvexPoly(plan, cone, faint, cv2.LINE_AA)
    cv2.circle(plan, spot, 18, color, -1, cv2.LINE_AA)
    centred(plan, str(number), spot[0], spot[1] + 7, 20, (255, 255, 255))


def _around(azimuth: float, radius: float) -> tuple[int, int]:
    """Return the pixel at an azimuth of the plan: the object's front, +x, points down."""
    return (round(_PLAN / 2 + radius * math.sin(azimuth)),
            round(_PLAN / 2 + radius * math.cos(azimuth)))


def _draw_view(picture: NDArray[np.uint8], left: int, top: int, number: int, view: ViewResult,
               heights: tuple[int, int], draw: DrawVoxels) -> None:
    middle = left + TILE // 2
    if view.image is not None:
        side = TILE - 20
        image = cv2.resize(view.image, (side, side), interpolation=cv2.INTER_CUBIC)
        paste(picture, np.asarray(image, np.uint8), left + 10, top + 10)
    cv2.rectangle(picture, (left + 10, top + 10), (left + TILE - 10, top + TILE - 10),
                  view_color(number), 3, cv2.LINE_AA)
    caption = f'{number}   {whole_degrees(view.camera.azimuth)}°'
    centred(picture, caption, middle, top + TILE + 18, 19, view_color(number))
    if view.occupied is not None:
        paste(picture, draw(view.occupied, heights), left, top + TILE + 26)
    if view.iou is not None:
        expected = f', expected {view.quality.expected_iou:.2f}' if view.quality else ''
        centred(picture, f'IoU {view.iou:.2f}{expected}', middle, top + _BLOCK - 32, 19)


def _draw_truth(picture: NDArray[np.uint8], left: int, top: int, mesh: trimesh.Trimesh,
                truth: VoxelGrid, heights: tuple[int, int]) -> None:
    middle = left + TILE // 2
    paste(picture, _rendered(mesh), left, top)
    centred(picture, 'the object', middle, top + TILE + 18, 19)
    paste(picture, voxel_tile(truth, heights), left, top + TILE + 26)
    centred(picture, 'its voxels', middle, top + _BLOCK - 32, 19)


def _rendered(mesh: trimesh.Trimesh) -> NDArray[np.uint8]:
    return composite(Renderer(mesh).render(_tile_camera(), samples=3), np.array(PAPER, np.uint8))


def _tile_camera() -> Camera:
    return _camera(_LOOK_FROM, math.radians(25), 1.9, TILE)


def _camera(azimuth: float, elevation: float, distance: float, side: int) -> Camera:
    """Return a camera of square images whose field of view is the canonical one."""
    return Camera(orbit_camera(azimuth, elevation, distance).pose,
                  CANONICAL_INTRINSICS.resized(side, side))
