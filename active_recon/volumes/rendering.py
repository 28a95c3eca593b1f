"""Rendering of meshes and their depth: ray casting with Embree, flat shading, straight alpha."""

from typing import Any

from active_recon.geometry.cameras import Camera
import cv2
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from numpy.typing import NDArray
import trimesh

# The light comes from above and left of the camera, so that no view of a turntable is dark.
_LIGHT = np.array([-0.45, -0.65, -0.61])  # towards the light, in the optical frame
_AMBIENT, _DIFFUSE = 0.38, 0.66
_NOWHERE = 1e30  # Embree's distance of what a ray does not hit is larger


class Renderer:
    """
    Renders a mesh, given in the object frame, from any camera.

    Every face has one colour, with vertex colours or a texture the mean of its corners. Both sides
    of a face are lit alike, because the winding of downloaded models is unreliable.
    """

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self._scene = EmbreeScene()
        # Embree's wrapper frees the mesh with its Python object, so keep a reference
        self._geometry = TriangleMesh(self._scene, mesh.triangles.astype(np.float32))
        self._vertices = np.asarray(mesh.vertices)
        self._normals = np.asarray(mesh.face_normals, np.float32)
        self._colors = _face_colors(mesh)

    def render(self, camera: Camera, samples: int = 2,
               light: NDArray[np.float64] | None = None) -> NDArray[np.uint8]:
        """
        Return the image of a camera, (height, width, 4) uint8 RGBA, transparent where empty.

        `samples` x `samples` rays are cast in each pixel: 1 is fastest, 2 smooths the edges.
        `light` is the unit vector (3,) towards the light in the optical frame; None puts it above
        and left of the camera.
        """
        lens = camera.intrinsics
        left, top, right, bottom = self._bounds(camera)
        image = np.zeros((lens.height, lens.width, 4), np.uint8)
        if left >= right or top >= bottom:
            return image
        rays = camera.ray_directions(samples, (left, top, right, bottom)).astype(np.float32)
        height, width = rays.shape[:2]
        origins = np.broadcast_to(camera.position.astype(np.float32), (height * width, 3))
        hit = self._scene.run(np.ascontiguousarray(origins), rays.reshape(-1, 3))
        # The last row of the table is for rays that hit nothing (-1).
        shaded = self._shaded(camera, _LIGHT if light is None else light)
        seen = np.take(shaded, hit, axis=0, mode='wrap').reshape(height, width, 4)
        if samples > 1:
            seen = _averaged(seen, (right - left, bottom - top))
        image[top:bottom, left:right] = seen
        return image

    def depth(self, camera: Camera) -> NDArray[np.float32]:
        """
        Return the depth of what a camera sees, (height, width), 0 where it sees nothing.

        That is the distance along the optical axis, in the unit of the mesh, of what the ray
        through each pixel's centre hits first.
        """
        lens = camera.intrinsics
        left, top, right, bottom = self._bounds(camera)
        depth = np.zeros((lens.height, lens.width), np.float32)
        if left >= right or top >= bottom:
            return depth
        rays = camera.ray_directions(1, (left, top, right, bottom)).astype(np.float32)
        rays = rays.reshape(-1, 3)
        origins = np.broadcast_to(camera.position.astype(np.float32), rays.shape)
        found = self._scene.run(np.ascontiguousarray(origins), rays, query='DISTANCE')
        found = np.where(found < _NOWHERE, found, 0)
        depth[top:bottom, left:right] = found.reshape(bottom - top, right - left)
        return depth

    def _bounds(self, camera: Camera) -> tuple[int, int, int, int]:
        """Return left, top, right, bottom of the pixels that the mesh can touch."""
        lens = camera.intrinsics
        pixels, depth = camera.project(self._vertices)
        # A camera inside the mesh, or a distorting lens, needs the whole image
        if depth.min() <= 1e-3 or lens.distortion is not None:
            return 0, 0, lens.width, lens.height
        left, top = np.maximum(np.floor(pixels.min(axis=0)).astype(int), 0)
        right, bottom = np.ceil(pixels.max(axis=0)).astype(int)
        return left, top, min(right, lens.width), min(bottom, lens.height)

    def _shaded(self, camera: Camera, light: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the lit RGBA of each face, (faces + 1, 4), the last row transparent."""
        towards = (camera.pose[:3, :3] @ light).astype(np.float32)
        brightness = _AMBIENT + _DIFFUSE * np.abs(self._normals @ towards)
        shaded = np.zeros((len(brightness) + 1, 4), np.uint8)
        np.minimum(self._colors * brightness[:, None], 255, out=shaded[:-1, :3], casting='unsafe')
        shaded[:-1, 3] = 255
        return shaded


def _face_colors(mesh: trimesh.Trimesh) -> NDArray[np.float32]:
    """Return one RGB for each face, (faces, 3) in [0, 255]; grey for a mesh without colours."""
    visual: Any = mesh.visual
    if visual is None or visual.kind is None:
        return np.full((len(mesh.faces), 3), 178, np.float32)
    if visual.kind != 'texture':
        return np.asarray(visual.face_colors[:, :3], np.float32)
    corners = visual.material.to_color(visual.uv)
    if np.ndim(corners) != 2:  # a material without a texture image
        corners = np.tile(visual.material.main_color, (len(mesh.vertices), 1))
    colors: NDArray[np.float32] = corners[mesh.faces, :3].mean(axis=1, dtype=np.float32)
    return colors


def _averaged(rgba: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Average blocks of samples down to (width, height), colours weighted by their alpha."""
    mean = np.asarray(cv2.resize(rgba.astype(np.float32), size, interpolation=cv2.INTER_AREA))
    # Empty samples are black, so the mean colour is already multiplied by the mean alpha.
    mean[..., :3] *= (255 / np.maximum(mean[..., 3:], 1)).astype(np.float32)
    averaged: NDArray[np.uint8] = np.rint(np.minimum(mean, 255)).astype(np.uint8)
    return averaged


def composite(rgba: NDArray[np.uint8], background: float | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Return an RGBA image (H, W, 4) composited over a background, (H, W, 3) uint8 RGB.

    The background is a grey in [0, 255] or an RGB image (H, W, 3).
    """
    alpha = rgba[..., 3:].astype(np.float32) / 255
    mixed = rgba[..., :3] * alpha + np.asarray(background, np.float32) * (1 - alpha)
    composed: NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
    return composed
