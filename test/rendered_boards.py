"""Images of a printed board as a camera with a known lens sees it from known poses."""

from functools import cache
import math

from active_recon.calibration.board import Board
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.lenses import Distortion
import cv2
import numpy as np

BOARD = Board(columns=9, rows=7, square=0.03, marker=0.0225)
LENS = Intrinsics(730, 730, 320, 240, 640, 480)
WIDE = Intrinsics(530, 532, 325.5, 233.5, 640, 480,
                  Distortion('plumb_bob', (-0.18, 0.06, 0.001, -0.0015, 0.0)))
_PIXELS_PER_MM = 4
_SAMPLES = 2


def render(lens, camera_from_board, noise=0.0, board=BOARD, seed=0):
    """Return the board on a grey ground, (H, W, 3) uint8, with noise of so many grey levels."""
    margin = 10 * _PIXELS_PER_MM
    sheet = np.pad(board.drawn(_PIXELS_PER_MM), margin, constant_values=255)
    # A ray meets the board's plane where board from ray, a homography, carries it
    onto = np.linalg.inv(camera_from_board[:3, [0, 1, 3]])
    scale = _PIXELS_PER_MM * 1e3
    onto = np.array([[scale, 0, margin - 0.5], [0, scale, margin - 0.5], [0, 0, 1]]) @ onto
    there = cv2.perspectiveTransform(_rays(lens), onto)
    seen = cv2.remap(sheet, there, None, cv2.INTER_LINEAR, borderValue=120)
    seen = cv2.resize(seen, (lens.width, lens.height), interpolation=cv2.INTER_AREA)
    seen = seen.astype(np.float32)
    if noise:
        seen = cv2.GaussianBlur(seen, (0, 0), 0.7)
        seen += np.random.default_rng(seed).normal(0, noise, seen.shape)
    return np.repeat(seen.clip(0, 255).astype(np.uint8)[..., None], 3, axis=2)


@cache
def _rays(lens):
    """Return the ray of each sample, (H, W, 2) float32, at depth 1."""
    shape = lens.height * _SAMPLES, lens.width * _SAMPLES
    places = (np.indices(shape)[::-1] + 0.5) / _SAMPLES
    # OpenCV itself bends the image, by whose means our lenses are to be found again
    bent = np.array(lens.distortion.coefficients if lens.distortion else (0.0,) * 5)
    rays = cv2.undistortPoints(places.reshape(2, -1).T[:, None].astype(np.float32),
                               lens.matrix, bent)
    return rays.reshape(*shape, 2)


def fixed_camera(elevation_deg=35.0, distance=0.5, height=0.0, aside=0.02):
    """Return the camera beside a table, looking a little past the axis, in the table's frame."""
    pose = orbit_camera(0.0, math.radians(elevation_deg), distance).pose
    turn, _ = cv2.Rodrigues(np.array([0.02, 0.03, 0.05]))
    pose = pose.copy()
    pose[:3, :3] = pose[:3, :3] @ turn
    pose[:3, 3] += [0, aside, height]
    return Camera(pose)


def on_table(angle, shift=(-0.14, 0.08), yaw=0.4, tilt_deg=0.0):
    """Return table-at-0 from board, (4, 4), of a table turned by an angle counter-clockwise."""
    def about(axis, by):
        frame = np.eye(4)
        frame[:3, :3] = cv2.Rodrigues(np.eye(3)[axis] * by)[0]
        return frame

    lying = about(1, math.radians(tilt_deg)) @ np.diag([1.0, -1, -1, 1])
    lying = about(2, yaw) @ _moved(*shift) @ lying
    return about(2, angle) @ lying


def _moved(x, y):
    frame = np.eye(4)
    frame[:2, 3] = x, y
    return frame
