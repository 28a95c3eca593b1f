"""Depth images beside the views of an object, and which of them can be used."""

from dataclasses import dataclass

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.framing import cube_corners
import numpy as np
from numpy.typing import NDArray

MM_PER_METRE = 1000
"""Depth images of 16 bits are in millimetres."""
_LEAST_WITHIN = 0.01  # share of the values before the cube that have to lie in it
_MARGIN = 0.25  # sides of the cube, before and behind it, that count as in it here


@dataclass(frozen=True, eq=False)
class DepthImage:
    """
    What a depth camera measured.

    - metres: (H, W) float, the distance along the optical axis; what is not finite or not above
      0 is no value
    - camera: its camera, with a pose in the object frame; None: that of the view's image, with
      whose pixels the depth is aligned
    """

    metres: NDArray[np.floating]
    camera: Camera | None = None


def registered(image: DepthImage, pose: NDArray[np.float64]) -> DepthImage:
    """
    Return the depth as a camera with the same lens at another pose, (4, 4), sees it.

    Where several values fall on a pixel, the nearest counts; pixels on which none falls have no
    value. `image` has a camera of its own.
    """
    assert image.camera is not None, 'depth without a camera is aligned with an image'
    lens = image.camera.intrinsics
    target = Camera(pose, lens)
    valid = _has_value(image.metres)
    rays = image.camera.ray_directions()[valid]  # (N, 3), of depth 1
    pixels, depths = target.project(image.camera.position + rays * image.metres[valid][:, None])
    with np.errstate(invalid='ignore'):
        inside = (depths > 0) & ((pixels >= 0) & (pixels < (lens.width, lens.height))).all(axis=1)
    columns, rows = pixels[inside].astype(int).T
    found = np.full((lens.height, lens.width), np.inf, np.float32)
    np.minimum.at(found, (rows, columns), depths[inside].astype(np.float32))
    return DepthImage(np.where(np.isinf(found), np.float32(0), found), target)


def usable_depth(image: DepthImage, view: Camera,
                 object_size: float) -> tuple[NDArray[np.float32], Camera]:
    """
    Return depth (H, W) and its camera, with lengths in sides of the cube of `object_size` metres.

    0 is no value. `view` is the camera of the image beside it. Raises ViewError where it is of
    another size than its camera's, where it has no value before the cube, or where its values
    contradict the camera: none of them in the cube, as with another unit, scale or alignment.
    """
    camera = image.camera or view
    lens, metres = camera.intrinsics, image.metres
    if metres.shape != (lens.height, lens.width):
        raise ViewError(f'wrong depth image: expected {lens.width} x {lens.height} pixels, as its '
                        'camera says, got '
                        f'{" x ".join(map(str, metres.shape[::-1])) or "a number"}; register it '
                        'to the image, or give its own camera', 'depth')
    depth = np.where(_has_value(metres), metres, 0).astype(np.float32) / np.float32(object_size)
    placed = camera.scaled(1 / object_size)
    _require_fitting(depth, placed, object_size)
    return depth, placed


def _has_value(metres: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return where depth is finite and above 0."""
    with np.errstate(invalid='ignore'):
        return np.asarray(np.isfinite(metres) & (metres > 0))


def _require_fitting(depth: NDArray[np.float32], camera: Camera, object_size: float) -> None:
    pixels, corners = camera.project(cube_corners())
    near, far = max(float(corners.min()), 0.0), float(corners.max())
    if far <= 0:
        raise ViewError('depth camera looks away from the object: expected one that looks at it',
                        'depth')
    if near > 0:
        left, top = np.maximum(np.floor(pixels.min(axis=0)).astype(int), 0)
        right, bottom = np.maximum(np.ceil(pixels.max(axis=0)).astype(int), 0)
        depth = depth[top:bottom, left:right]
    found = depth[depth > 0]
    if not found.size:
        raise ViewError("empty depth image: expected distances where the object's cube is, got no "
                        'value above 0 there', 'depth')
    if _fits(found, near, far):
        return
    hint = '; are its unit, its scale and its alignment with the image right?'
    if _fits(found * MM_PER_METRE, near, far):
        hint = '; metres read as millimetres? 16 bits are millimetres, floats are metres'
    elif near > 0 and _fits(found / MM_PER_METRE, near, far):
        hint = '; millimetres read as metres? 16 bits are millimetres, floats are metres'
    raise ViewError(
        "depth contradicts the camera: expected distances in the object's cube, "
        f'{near * object_size:.3g} to {far * object_size:.3g} m, got '
        f'{float(np.median(found)) * object_size:.3g} m in the middle{hint}', 'depth')


def _fits(depth: NDArray[np.floating], near: float, far: float) -> bool:
    # The margin does not reach a camera that is near: a thousandth of any distance would be in it
    within = (depth > max(near - _MARGIN, near / 2)) & (depth < far + _MARGIN)
    return float(within.mean()) >= _LEAST_WITHIN
