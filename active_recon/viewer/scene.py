"""The loop as a 3D scene; lengths are in sides of the voxel grid, whatever its size."""

import math
from typing import Any

from active_recon.geometry.cameras import Camera, whole_degrees
from active_recon.geometry.view_distance import at_one_elevation, directions_of, view_distance
from active_recon.meshes.files import glb
from active_recon.policies.reasons import GoalReason
from active_recon.view_colors import Color, view_color
from active_recon.viewer.state import LoopState, Scores
from active_recon.viewer.view_result import Surface, ViewResult
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
import trimesh
from viser import SceneApi
from viser.transforms import SO3

_NEXT_COLOR: Color = (250, 196, 0)
_NOW_COLOR: Color = (120, 126, 138)
_BAR_COLOR: Color = (176, 186, 204)
_FLOOR = -0.5  # the grid's lowest side
_BAR_RADIUS = 1.15  # outside of the cube, inside the cameras
_BAR_HEIGHT = 0.3
_BAR_WIDTH = 0.06
_CUBE_SIDE = 0.1
_FRUSTUM = 0.22
_BOX: Any = trimesh.creation.box()
_COLORS: NDArray[np.uint8] = np.asarray(cv2.applyColorMap(
    np.arange(256, dtype=np.uint8), cv2.COLORMAP_VIRIDIS), np.uint8).reshape(-1, 3)[:, ::-1]
_GAP = 0.93  # of a cell: the gaps make single voxels visible


class Scene:
    """The viser scene of a state; only what has changed since the last is sent."""

    def __init__(self, scene: SceneApi, object_size: float, has_front: bool = True) -> None:
        self._scene = scene
        self._size = object_size
        self._shown = LoopState()
        self._threshold = math.nan
        self._surface: Surface | None = None
        self._views: list[Any] = []
        # Updating an object costs a fraction of creating it anew
        self._objects: dict[str, Any] = {}
        self._cell_side = math.nan
        # An environment map looks no better here, and is half the work without a graphics card
        scene.configure_environment_map(None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_hemisphere('/sky', sky_color=(255, 255, 255),
                                   ground_color=(176, 182, 196), intensity=1.3)
        scene.add_cylinder('/turntable', 0.78, 0.02, (226, 229, 236), radial_segments=64,
                           position=(0, 0, _FLOOR - 0.015), cast_shadow=False)
        if has_front:
            scene.add_label('/front', 'front', position=(0.88, 0, _FLOOR), anchor='center-center',
                            font_screen_scale=0.8)

    def set_object_size(self, object_size: float) -> None:
        """Clear the scene and set the side of the voxel grid, metres."""
        self.draw(LoopState(), self._threshold)
        self._remove('/camera')
        self._size = object_size

    def draw(self, state: LoopState, threshold: float, in_colors: bool = False) -> None:
        """Draw a state: the cells above the threshold, or the surface in colours if known."""
        before, self._shown = self._shown, state
        surface = state.surface if in_colors else None
        if surface is not self._surface:
            self._surface = surface
            self._draw_surface(surface)
            self._threshold = math.nan
        if state.grid is not before.grid or threshold != self._threshold:
            self._threshold = threshold
            self._draw_grid(None if surface is not None else state.grid, threshold)
        if state.views is not before.views or state.missed != before.missed:
            known = before.views if state.missed == before.missed else ()
            self._draw_views(known, state.views, state.missed)
        if state.goal is not before.goal or state.goal_reason is not before.goal_reason:
            self._draw_goal(state.goal, state.goal_reason)
        if state.scores is not before.scores:
            self._draw_scores(state.scores)
        if state.camera is not before.camera or state.picture is not before.picture:
            self._draw_camera(state.camera, state.picture)

    def _draw_grid(self, grid: VoxelGrid | None, threshold: float) -> None:
        cells = None if grid is None else shown_cells(grid, threshold)
        if cells is None or not len(cells):
            self._remove('/occupancy')
            return
        assert grid is not None
        side = _GAP * grid.cell_size / grid.size
        if side != self._cell_side:  # of another network
            self._cell_side = side
            self._remove('/occupancy')
        self._boxes('/occupancy', side, cells[:, :3], certainty_colors(cells[:, 3]))

    def _draw_surface(self, surface: Surface | None) -> None:
        self._remove('/surface')
        if surface is not None:
            corners = surface.triangles.reshape(-1, 3) / self._size
            self._objects['/surface'] = self._scene.add_glb('/surface', glb(trimesh.Trimesh(
                corners, np.arange(len(corners)).reshape(-1, 3), process=False,
                vertex_colors=surface.colors.reshape(-1, 3))))

    def _draw_scores(self, scores: Scores | None) -> None:
        scores = None if scores is None else scores.finite()
        if scores is None or not len(scores.scores):
            self._remove('/scores')
            return
        centers, sides = score_boxes(scores)
        colors = np.full((len(centers), 3), _BAR_COLOR, np.uint8)
        colors[np.argmax(scores.scores)] = _NEXT_COLOR
        self._boxes('/scores', _BAR_WIDTH, centers, colors, sides / _BAR_WIDTH)

    def _draw_views(self, before: tuple[ViewResult, ...], views: tuple[ViewResult, ...],
                    missed: int) -> None:
        kept = bool(before) and before == views[:len(before)]
        if not kept:
            for handle in self._views:
                handle.remove()  # with its label
            self._views.clear()
        first = len(before) if kept else 0
        for index, view in enumerate(views[first:], first):
            number = missed + index + 1
            name, color = f'/views/{number}', view_color(number)
            again = _at_same_place(view, views[:index])
            self._views.append(self._frustum(name, view.camera, color, view.image))
            self._label(f'{name}/label', f'{number} · {whole_degrees(view.camera.azimuth)}°',
                        again)

    def _draw_goal(self, goal: Camera | None, reason: GoalReason | None) -> None:
        if goal is None:
            self._remove('/goal/label')
            self._remove('/goal')
            return
        words = f'next · {whole_degrees(goal.azimuth)}°'
        if reason is not None and reason.gain is not None:
            words += f' · IoU {reason.gain:+z.3f}'
        if '/goal' in self._objects:
            self._place(self._objects['/goal'], goal)
            self._objects['/goal/label'].text = words
            return
        self._objects['/goal'] = self._frustum('/goal', goal, _NEXT_COLOR, None)
        self._objects['/goal/label'] = self._label('/goal/label', words)

    def _draw_camera(self, camera: Camera | None, picture: NDArray[np.uint8] | None) -> None:
        if camera is None:
            return
        if '/camera' not in self._objects:
            self._objects['/camera'] = self._frustum(
                '/camera', camera, _NOW_COLOR, picture, 0.8 * _FRUSTUM)
            return
        known = self._objects['/camera']
        self._place(known, camera)
        if picture is not None and picture is not known.image:
            known.image = picture

    def _frustum(self, name: str, camera: Camera, color: Color,
                 image: NDArray[np.uint8] | None, scale: float = _FRUSTUM) -> Any:
        return self._scene.add_camera_frustum(
            name, *_angle_and_aspect(camera), scale=scale, color=color, image=image,
            thickness=0.012, cast_shadow=False,
            wxyz=SO3.from_matrix(camera.pose[:3, :3]).wxyz, position=camera.position / self._size)

    def _place(self, frustum: Any, camera: Camera) -> None:
        frustum.fov, frustum.aspect = _angle_and_aspect(camera)
        frustum.position = camera.position / self._size
        frustum.wxyz = SO3.from_matrix(camera.pose[:3, :3]).wxyz

    def _label(self, name: str, words: str, others: int = 0) -> Any:
        # Above the camera and the labels of others there: y points down in the optical frame
        return self._scene.add_label(
            name, words, position=(0, -0.62 * _FRUSTUM - 0.1 * others, _FRUSTUM),
            anchor='bottom-center', font_screen_scale=0.9)

    def _boxes(self, name: str, side: float, centers: NDArray[np.floating],
               colors: NDArray[np.uint8], scales: NDArray[np.floating] | None = None) -> None:
        """Draw cubes of a fixed side at `centers` (N, 3), stretched by `scales` (N, 3)."""
        # The browser reads scales as 32 bits, whatever their type
        lengths = None if scales is None else np.asarray(scales, np.float32)
        upright = np.tile(np.array([1, 0, 0, 0], np.float32), (len(centers), 1))
        known = self._objects.get(name)
        if known is None:
            self._objects[name] = self._scene.add_batched_meshes_simple(
                name, side * _BOX.vertices, _BOX.faces, upright, centers, batched_scales=lengths,
                batched_colors=colors, flat_shading=True, lod='off', cast_shadow=False,
                receive_shadow=False)
            return
        if len(known.batched_wxyzs) != len(upright):
            known.batched_wxyzs = upright
        known.batched_positions = centers
        known.batched_colors = colors
        if lengths is not None:
            known.batched_scales = lengths

    def _remove(self, name: str) -> None:
        known = self._objects.pop(name, None)
        if known is not None:
            known.remove()


def _angle_and_aspect(camera: Camera) -> tuple[float, float]:
    """Return a camera's angle from the top of its image to its bottom, radians, and its aspect."""
    lens = camera.intrinsics
    return 2 * math.atan(lens.height / 2 / lens.fy), lens.width / lens.height


def _at_same_place(view: ViewResult, others: tuple[ViewResult, ...]) -> int:
    """Return how many other views were taken from the same place."""
    return sum(view_distance(other.camera, view.camera) < math.radians(7) for other in others)


def shown_cells(grid: VoxelGrid, threshold: float) -> NDArray[np.float32]:
    """
    Return the cells above the threshold that are visible from outside, (N, 4).

    Each is x, y, z in sides of the grid, and its occupancy.
    """
    occupied = grid.occupied(threshold)
    outside = np.where(binary_erosion(occupied), 0, grid.occupancy)
    return VoxelGrid(outside.astype(np.float32)).points(threshold)


def certainty_colors(occupancy: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return colours, (N, 3) RGB, from light (probability 0) to dark (probability 1)."""
    return _COLORS[np.rint(235 - 195 * occupancy).astype(np.uint8)]


def score_boxes(scores: Scores) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Return the centres and the sides of the boxes that show scores, (N, 3) each, in grid sides.

    They are bars around the turntable, the higher the better. Where the candidates' elevations
    differ by more than 10 degrees they are cubes on a sphere, the larger the better.
    """
    directions = directions_of(scores.positions)
    shares = relative_scores(scores.scores)
    if not at_one_elevation(directions):
        return _BAR_RADIUS * directions, np.repeat(_CUBE_SIDE * shares[:, None], 3, axis=1)
    heights = _BAR_HEIGHT * shares
    around = directions[:, :2] / np.linalg.norm(directions[:, :2], axis=1, keepdims=True)
    return (np.column_stack([_BAR_RADIUS * around, _FLOOR + heights / 2]),
            np.column_stack([np.full((len(heights), 2), _BAR_WIDTH), heights]))


def relative_scores(scores: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return scores mapped to 0.05 (the lowest) to 1 (the best): they have no unit."""
    low, high = float(scores.min()), float(scores.max())
    share = (np.asarray(scores, np.float64) - low) / (high - low) if high > low else np.zeros(
        len(scores))
    return 0.05 + 0.95 * share
