"""Voxels as boxes that a renderer can show."""

from active_recon.geometry.cameras import Camera
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray
import trimesh

_GAP = 0.93  # of a cell: the seams let the single voxels be told apart


def height_range(grid: VoxelGrid) -> tuple[int, int]:
    """Return the lowest and the highest layer of cells above 0; the whole grid's where none is."""
    layers = np.flatnonzero(grid.occupied(0).any(axis=(0, 1)))
    return (layers[0], layers[-1]) if len(layers) else (0, grid.occupancy.shape[2] - 1)


def voxel_boxes(grid: VoxelGrid, heights: tuple[int, int]) -> trimesh.Trimesh | None:
    """
    Return a box for each cell above 0, coloured by its height; None where there is none.

    `heights` are the layers between which the colours go. The grid's own size is scaled to 1, as
    the renderer's cameras expect it.
    """
    index = np.argwhere(grid.occupied(0))
    if len(index) == 0:
        return None
    side = grid.occupancy.shape[0]
    box = trimesh.creation.box(extents=[_GAP / side] * 3)
    centers = (index + 0.5) / side - 0.5
    vertices = (centers[:, None] + box.vertices).reshape(-1, 3)
    first = np.arange(len(index))[:, None, None] * len(box.vertices)
    faces = (first + box.faces).reshape(-1, 3)
    low, high = heights
    share = np.clip((index[:, 2] - low) / max(high - low, 1), 0, 1)
    shades = np.rint(40 + 200 * share).astype(np.uint8)
    rgb = cv2.applyColorMap(shades, cv2.COLORMAP_VIRIDIS).reshape(-1, 3)[:, ::-1]
    return trimesh.Trimesh(vertices, faces, face_colors=np.repeat(rgb, len(box.faces), axis=0),
                           process=False)


def voxel_picture(grid: VoxelGrid, heights: tuple[int, int], camera: Camera,
                  background: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return what a camera sees of the cells above 0, (H, W, 3) RGB; see `voxel_boxes`."""
    ground = np.full((camera.intrinsics.height, camera.intrinsics.width, 3), background, np.uint8)
    boxes = voxel_boxes(grid, heights)
    return ground if boxes is None else composite(Renderer(boxes).render(camera, 3), ground)
