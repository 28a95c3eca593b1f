"""Photos of an object that stands on a printed board, before clutter."""

from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.volumes.rendering import Renderer
import cv2
import numpy as np
from rendered_boards import BOARD, LENS, render

FACE_UP = np.diag([1.0, -1.0, -1.0, 1.0])
MIDDLE = np.array([BOARD.columns, -BOARD.rows, 0]) * BOARD.square / 2
"""Of the board, in the photos' world: z up, the origin at the board's first corner."""
_GREY = 120  # of the ground in the rendered images


def standing(mesh, size):
    """Return a copy of a mesh that stands on the middle of the board, its longest side `size`."""
    placed = mesh.copy()
    placed.apply_scale(size / placed.extents.max())
    low, high = placed.bounds
    placed.apply_translation(MIDDLE - [*(low + high)[:2] / 2, low[2]])
    return placed


def around(count, height, seed=0, elevations=(0.45, 1.0), distance=0.5):
    """Return cameras around the board, which look at a height above its middle."""
    rng = np.random.default_rng(seed)
    cameras = []
    for number in range(count):
        pose = orbit_camera(number * 2 * np.pi / count + rng.uniform(0, 0.3),
                            rng.uniform(*elevations), distance).pose.copy()
        pose[:3, 3] += MIDDLE + [0, 0, height]
        cameras.append(Camera(pose, LENS))
    return cameras


def photographed(mesh, cameras, seed=0):
    """Return the photos, (H, W, 3) uint8 each, and the true masks, (H, W) bool each."""
    rng = np.random.default_rng(seed)
    renderer, images, masks = Renderer(mesh), [], []
    ground = cv2.resize(rng.integers(0, 256, (12, 16, 3), np.uint8), (LENS.width, LENS.height),
                        interpolation=cv2.INTER_CUBIC)
    for number, camera in enumerate(cameras):
        board = render(LENS, np.linalg.inv(camera.pose) @ FACE_UP, noise=2, seed=number)
        plain = (np.abs(board.astype(int) - _GREY).max(axis=2) < 12).astype(np.uint8)
        beyond = cv2.morphologyEx(plain, cv2.MORPH_OPEN, np.ones((15, 15), np.uint8)) > 0
        behind = np.where(beyond[..., None], ground, board)
        rgba = renderer.render(camera)
        alpha = rgba[..., 3:] / 255
        images.append(np.rint(rgba[..., :3] * alpha + behind * (1 - alpha)).astype(np.uint8))
        masks.append(rgba[..., 3] > 127)
    return images, masks
