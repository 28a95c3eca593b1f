"""The colours of a surface's corners, from the photographs that show them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from active_recon.geometry.cameras import Camera
from active_recon.meshes.exposure import find_exposure
from active_recon.meshes.photos import Photo
import cv2
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree
import trimesh

_LEAST_COSINE = 0.25
"""Of the angle between a corner's normal and the way to the camera: beyond it nothing is seen."""
_SHARPNESS = 2
"""Power of that cosine in the weights: the views that face a corner count most."""
_RIM = 1e-3
"""Weight of what is beside a jump in depth: it may show what is behind."""
_JUMP = 0.03
"""A jump in depth, in diagonals of the mesh."""
_SURE = 0.01
"""Weight of all samples above which a corner's colour is known."""
_NEAR_RINGS = 16
"""Corners from one to the next over which it spreads to those that are known less well."""
_OFF = 20.0
"""Deviation from the blend, 0 to 255, above which a sample weighs less."""
_FAR = 1e6
"""A depth beyond all meshes: rays that meet nothing have a larger one."""
_NEAR_SHARE = 12
"""Share of a photograph's side within which its background is looked at."""
_ALIKE = 40.0
"""Difference of colours, 0 to 255, up to which they are taken for alike."""
_SMOOTHED = 4
"""How often normals are averaged with their neighbours'."""
_LIFT = 2e-3
"""How far above the surface a ray to the camera starts, in diagonals of the mesh."""


@dataclass(frozen=True, eq=False)
class SurfaceColors:
    """
    Colours of a mesh's V corners.

    - colors: (V, 3) uint8 RGB
    - seen: (V,), whether a photograph shows the corner; the others are coloured as their
      neighbours
    """

    colors: NDArray[np.uint8]
    seen: NDArray[np.bool_]


def surface_colors(mesh: trimesh.Trimesh, photos: Sequence[Photo]) -> SurfaceColors | None:
    """
    Return the colours of a mesh in the object frame; None where no photograph shows any of it.

    A photograph shows a corner that faces it with nothing of the mesh between. Exposures are
    evened, see `find_exposure`. A corner has the mean of its colours, weighted by the square
    of the cosine under which it is seen; near the rim of what is in front, samples count
    only where there are no others, and those that differ from the mean count less.
    """
    scene = _Scene(mesh)
    samples = [scene.sampled(photo) for photo in photos]
    if not samples or not any(weights.any() for _, weights in samples):
        return None
    colors = np.stack([color for color, _ in samples])
    weights = np.stack([weight for _, weight in samples])
    normals = np.stack([scene.normals @ photo.camera.pose[:3, :3] for photo in photos])
    colors = find_exposure(colors, np.sqrt(weights), normals).evened(colors, normals)
    seen = np.asarray(weights.any(axis=0))
    blended = _blended(colors, weights)
    for _ in range(2):
        off = np.linalg.norm(colors - blended, axis=2)
        blended = _blended(colors, weights / (1 + (off / _OFF) ** 2) ** 2)
    # What may be background counts only where no corner is near that is known better
    filled, done = _filled(mesh, blended, weights.sum(axis=0) > _SURE, _NEAR_RINGS)
    filled[seen & ~done] = blended[seen & ~done]
    filled, done = _filled(mesh, filled, seen | done, len(filled))
    if not done.all():  # bodies of which nothing is seen
        _, nearest = cKDTree(mesh.vertices[done]).query(mesh.vertices[~done])
        filled[~done] = filled[done][nearest]
    return SurfaceColors(np.rint(np.clip(filled, 0, 255)).astype(np.uint8), seen)


def colored(mesh: trimesh.Trimesh, photos: Sequence[Photo]) -> trimesh.Trimesh:
    """Return a mesh with colours at its corners; without any if no photograph shows it."""
    found = surface_colors(mesh, photos)
    if found is None:
        return mesh
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=found.colors, process=False)


class _Scene:
    """A mesh as rays meet it."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self._embree = EmbreeScene()
        # Embree's wrapper frees the mesh with its Python object, so keep a reference
        self._geometry = TriangleMesh(self._embree, mesh.triangles.astype(np.float32))
        self._vertices = np.asarray(mesh.vertices)
        self.normals = _smooth_normals(mesh)
        self._diagonal = float(np.linalg.norm(mesh.extents))

    def sampled(self, photo: Photo) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the colours (V, 3), 0 to 255, of the corners and their weights (V,)."""
        camera = photo.camera
        lens = camera.intrinsics
        pixels, ahead = camera.project(self._vertices)
        way = camera.position - self._vertices
        cosines = (self.normals * way).sum(axis=1) / np.linalg.norm(way, axis=1)
        shown = (cosines > _LEAST_COSINE) & (ahead > 0)
        shown[shown] = ((pixels[shown] >= 0.5) & (
            pixels[shown] <= [lens.width - 0.5, lens.height - 0.5])).all(axis=1)
        shown[shown] = self._in_sight(self._vertices[shown] + _LIFT * self._diagonal
                                      * self.normals[shown], camera.position)
        # OpenCV counts from the centre of the first pixel
        at = np.where(shown[:, None], pixels - 0.5, 0).astype(np.float32)
        found = _looked_up(photo.image.astype(np.float32), at)
        if photo.image.shape[2] == 4:
            shown &= found[:, 3] > 254
        depth = self._depth(camera)
        pixel = tuple(np.rint(at[:, ::-1]).astype(np.intp).T)
        rim = _jumps(depth, _JUMP * self._diagonal)[pixel]
        doubt = _background_share(found[:, :3], photo.image, depth > _FAR, pixel)
        weights = shown * cosines ** _SHARPNESS * np.where(rim, _RIM, 1) * np.maximum(
            1 - doubt, _RIM)
        return found[:, :3], weights.astype(np.float32)

    def _in_sight(self, points: NDArray[np.float64],
                  eye: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return between which points and the eye there is nothing."""
        hit = self._embree.run(points.astype(np.float32), (eye - points).astype(np.float32))
        return np.asarray(hit < 0)

    def _depth(self, camera: Camera) -> NDArray[np.float32]:
        """Return the depth of the mesh in each pixel, (H, W); above `_FAR` where it is not."""
        rays = camera.ray_directions().astype(np.float32)
        origins = np.broadcast_to(camera.position.astype(np.float32),
                                  (rays.shape[0] * rays.shape[1], 3))
        found = self._embree.run(np.ascontiguousarray(origins), rays.reshape(-1, 3),
                                 query='DISTANCE')
        return np.asarray(found, np.float32).reshape(rays.shape[:2])


def _jumps(depth: NDArray[np.float32], least: float) -> NDArray[np.bool_]:
    """Return the pixels beside a jump in depth of at least so much, (H, W)."""
    around = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(depth, around) - cv2.erode(depth, around) > least)


def _background_share(colors: NDArray[np.float32], image: NDArray[np.uint8],
                      outside: NDArray[np.bool_], pixel: Any) -> NDArray[np.float32]:
    """
    Return how much colours (V, 3) at pixels look like the background near them, (V,) in [0, 1].

    `outside` (H, W) are the pixels where the mesh is not: a mesh that is a little too wide, or an
    object with gaps, shows the background there too.
    """
    side = max(image.shape[:2]) // _NEAR_SHARE | 1
    share = cv2.blur(outside.astype(np.float32), (side, side))
    mean = cv2.blur(image[..., :3] * outside[..., None].astype(np.float32), (side, side))
    near = np.asarray(share)[pixel]
    background = np.asarray(mean)[pixel] / np.maximum(near, 1e-6)[:, None]
    off = np.linalg.norm(colors - background, axis=1)
    return np.where(near > 0.02, np.exp(-(off / _ALIKE) ** 2), 0).astype(np.float32)


def _neighbours(mesh: trimesh.Trimesh) -> Any:
    """Return which corners an edge joins, a sparse (V, V)."""
    edges: Any = mesh.edges_unique
    ends = np.concatenate([edges, edges[:, ::-1]])
    return coo_array((np.ones(len(ends), np.float32), tuple(ends.T)),
                     shape=(len(mesh.vertices),) * 2).tocsr()


def _smooth_normals(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    """Return unit normals (V, 3) without the steps between cells."""
    normals, joined = np.asarray(mesh.vertex_normals), _neighbours(mesh)
    for _ in range(_SMOOTHED):
        normals = normals + joined @ normals
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals


def _looked_up(image: NDArray[np.float32], at: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an image's values (V, C) at pixels (V, 2), interpolated linearly."""
    rows = -(-len(at) // 1024)  # OpenCV's images have less than 32768 columns
    places = np.zeros((rows * 1024, 2), np.float32)
    places[:len(at)] = at
    across, down = places.reshape(rows, 1024, 2).transpose(2, 0, 1).copy()
    found = cv2.remap(image, across, down, cv2.INTER_LINEAR)
    return np.asarray(found, np.float32).reshape(rows * 1024, -1)[:len(at)]


def _blended(colors: NDArray[np.float32], weights: NDArray[np.float32]) -> NDArray[np.float32]:
    total = np.maximum(weights.sum(axis=0), 1e-12)
    return np.asarray(np.einsum('nvc,nv->vc', colors, weights) / total[:, None], np.float32)


def _filled(mesh: trimesh.Trimesh, colors: NDArray[np.float32], known: NDArray[np.bool_],
            rings: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """
    Return colours (V, 3) where those unknown are the mean of their neighbours', inwards.

    And which are known then, after so many steps from one corner to the next.
    """
    filled, done = colors.copy(), known.copy()
    joined = _neighbours(mesh)
    for _ in range(rings):
        count = joined @ done.astype(np.float32)
        reached = ~done & (count > 0)
        if not reached.any():
            break
        filled[reached] = ((joined[reached] @ (filled * done[:, None])) / count[reached, None])
        done |= reached
    return filled, done
