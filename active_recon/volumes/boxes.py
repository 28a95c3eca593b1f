"""Voxels as boxes, for the renderer."""

from active_recon.geometry.cameras import Camera
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray
import trimesh

_GAP = 0.93  # side of a box in cells: the gaps make single voxels visible


def height_range(grid: VoxelGrid) -> tuple[int, int]:
    """Return the lowest and highest layer (z index) with cells above 0; of an empty grid, all."""
    layers = np.flatnonzero(grid.occupied(0).any(axis=(0, 1)))
    return (layers[0], layers[-1]) if len(layers) else (0, grid.occupancy.shape[2] - 1)


def voxel_boxes(grid: VoxelGrid, heights: tuple[int, int],
                viewpoint: NDArray[np.float64] | None = None) -> trimesh.Trimesh | None:
    """
    Return a mesh with a box for each cell above 0, coloured by height; None for an empty grid.

    `heights` are the layers (z indices) at both ends of the colour map. The grid is scaled to
    side 1. With a `viewpoint`, (3,) and outside the boxes, faces that are turned away from it are
    left out: half of the mesh, and none that could be seen from there.
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
    colors = np.repeat(rgb, len(box.faces), axis=0)
    if viewpoint is not None:
        # (cells, 12): whether the viewpoint is on the outer side of a face's plane
        towards = (viewpoint - centers) @ box.face_normals.T > _GAP / side / 2
        faces, colors = faces[towards.ravel()], colors[towards.ravel()]
    return trimesh.Trimesh(vertices, faces, face_colors=colors, process=False)


def voxel_picture(grid: VoxelGrid, heights: tuple[int, int], camera: Camera,
                  background: tuple[int, int, int]) -> NDArray[np.uint8]:
    """
    Return a rendering of the cells above 0, (H, W, 3) uint8 RGB; see `voxel_boxes`.

    `camera` is in sides of the grid; `background` is RGB in [0, 255].
    """
    ground = np.full((camera.intrinsics.height, camera.intrinsics.width, 3), background, np.uint8)
    boxes = voxel_boxes(grid, heights, camera.position)
    return ground if boxes is None else composite(Renderer(boxes).render(camera, 3), ground)
