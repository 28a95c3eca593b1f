"""Photos of an object on a table with a pattern, before clutter; their poses are known."""

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.volumes.rendering import Renderer
import cv2
import numpy as np

LENS = Intrinsics(700, 700, 320, 240, 640, 480)
PATTERNS = {'boards': (6, 200), 'coarse': (12, 12), 'fine': (60, 60)}
"""Tables: of wood, or with spots in all colours; how many of them across and along."""
PRINT = 'print'
"""A table that is covered with a newspaper: words and pictures."""
_SIDE, _PIXELS = 1.5, 1024  # of the table, metres, and of its pattern
_NOISE = 2.0  # grey levels


def centred(mesh, size):
    """Return a copy of a mesh whose box is about the origin, its longest side `size`."""
    placed = mesh.copy()
    placed.apply_scale(size / placed.extents.max())
    placed.apply_translation(-placed.bounds.mean(axis=0))
    return placed


def around(count, distance, rng):
    """Return cameras around the origin, 17 to 52 degrees above it."""
    return [orbit_camera(number * 2 * np.pi / count + rng.uniform(0, 0.4), rng.uniform(0.3, 0.9),
                         distance, LENS) for number in range(count)]


def photographed(mesh, cameras, pattern, rng):
    """Return the photos, (H, W, 3) uint8 each, and the true masks, (H, W) bool each."""
    table, clutter = _table(pattern, rng), _enlarged(
        rng.integers(0, 256, (8, 12, 3)), LENS.width, LENS.height)
    renderer, images, masks = Renderer(mesh), [], []
    for camera in cameras:
        rgba = renderer.render(camera)
        behind = _behind(camera, mesh.bounds[0, 2], table, clutter)
        alpha = rgba[..., 3:] / 255
        image = rgba[..., :3] * alpha + behind * (1 - alpha)
        images.append(np.clip(image + rng.normal(0, _NOISE, image.shape), 0, 255).astype(np.uint8))
        masks.append(rgba[..., 3] > 127)
    return images, masks


def _table(pattern, rng):
    if pattern == PRINT:
        return _newspaper(rng)
    across, along = PATTERNS[pattern]
    if pattern != 'boards':
        return _enlarged(rng.integers(0, 256, (along, across, 3)), _PIXELS, _PIXELS)
    grain = _enlarged(rng.integers(90, 190, (across, along)), _PIXELS, _PIXELS)
    return grain[..., None] * [1.0, 0.75, 0.5]


def _newspaper(rng):
    sheet = np.full((_PIXELS, _PIXELS, 3), 235, np.uint8)
    for line in range(10, _PIXELS, 9):
        at = 0
        while at < _PIXELS:
            word = ''.join(map(chr, rng.integers(97, 123, rng.integers(2, 9))))
            cv2.putText(sheet, word, (at, line), cv2.FONT_HERSHEY_SIMPLEX, 0.3, (40, 40, 45), 1,
                        cv2.LINE_AA)
            at += 6 * len(word) + 6
    for across, down in rng.integers(0, _PIXELS - 120, (25, 2)):
        wide, high = rng.integers(40, 120, 2)
        sheet[down:down + high, across:across + wide] = _enlarged(
            rng.integers(0, 256, (5, 7, 3)), int(wide), int(high))
    return sheet.astype(np.float32)


def _enlarged(drawn, width, height):
    return cv2.resize(drawn.astype(np.float32), (width, height),
                      interpolation=cv2.INTER_CUBIC).clip(0, 255)


def _behind(camera: Camera, level, table, clutter):
    """Return what a camera sees of a table at a level, and of the clutter beyond it."""
    rays = camera.ray_directions().reshape(LENS.height, LENS.width, 3)
    down = np.minimum(rays[..., 2], -1e-9)
    met = camera.position + ((level - camera.position[2]) / down)[..., None] * rays
    across, along = (np.float32((met[..., axis] / _SIDE + 0.5) * _PIXELS) for axis in (0, 1))
    seen = cv2.remap(np.float32(table), across, along, cv2.INTER_LINEAR)
    on = ((rays[..., 2] < 0) & (across >= 0) & (across < _PIXELS - 1)
          & (along >= 0) & (along < _PIXELS - 1))
    return np.where(on[..., None], seen, clutter)
