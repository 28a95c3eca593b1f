"""One picture of a shape: photos as the network saw them, over the mesh from the same cameras."""

from collections.abc import Sequence
import math

from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framing_camera
from active_recon.photos.shape import Shape, TakenView
from active_recon.photos.views import even_choice
from active_recon.volumes.rendering import composite, Renderer
import cv2
import numpy as np
from numpy.typing import NDArray

_TILE = 256
_COLUMNS = 6
_GAP = 6
_PAPER = 250
_OUTLINE = (217, 95, 2)
_SHOWN = 2 * _COLUMNS


def shape_picture(shape: Shape) -> NDArray[np.uint8]:
    """
    Return the picture, (H, W, 3) uint8 RGB, of up to twelve photos at even steps.

    The outline of the shape is drawn over each photo. Raises DataError where no cell is occupied.
    """
    mesh = shape.mesh()
    mesh.apply_transform(np.diag([*[1 / shape.size] * 3, 1.0]))
    renderer = Renderer(mesh)
    views = even_choice(shape.views, _SHOWN)
    columns = min(len(views), _COLUMNS)
    rows = math.ceil(len(views) / columns)
    step, block = _TILE + _GAP, 2 * _TILE + 3 * _GAP
    picture = np.full((rows * block + _GAP, columns * step + _GAP, 3), _PAPER, np.uint8)
    for index, view in enumerate(views):
        top, left = _GAP + index // columns * block, _GAP + index % columns * step
        for below, tile in enumerate(_tiles(view, shape.size, renderer)):
            at = top + below * (_TILE + _GAP)
            picture[at:at + _TILE, left:left + _TILE] = tile
    return picture


def _tiles(view: TakenView, size: float, renderer: Renderer) -> Sequence[NDArray[np.uint8]]:
    """Return the photo with the shape's outline, and the shape, (TILE, TILE, 3) each."""
    assert view.known.image is not None
    camera = framing_camera(view.camera, size, _TILE).scaled(1 / size)
    rendered = renderer.render(Camera(camera.pose, camera.intrinsics))
    photo = np.asarray(cv2.resize(view.known.image[..., :3], (_TILE, _TILE),
                                  interpolation=cv2.INTER_CUBIC), np.uint8)
    lines, _ = cv2.findContours((rendered[..., 3] > 127).astype(np.uint8), cv2.RETR_LIST,
                                cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(photo, lines, -1, _OUTLINE, 1, cv2.LINE_AA)
    return photo, composite(rendered, _PAPER)
