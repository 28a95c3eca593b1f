"""Mesh files read into the object frame, z up and front +x, optionally fitted to the grid."""

from pathlib import Path
from typing import Any

from active_recon.errors import ConfigError, MeshError
from active_recon.volumes.srgb import from_linear
import numpy as np
from numpy.typing import NDArray
import trimesh

GLTF = {'.glb', '.gltf'}
_AXES = {sign + name: (-1 if sign == '-' else 1) * np.eye(3)[i]
         for i, name in enumerate('xyz') for sign in ('', '+', '-')}


def upright(up: str, front: str) -> NDArray[np.float64]:
    """
    Return the rotation, (3, 3), that turns axis `up` to +z and axis `front` to +x.

    Raises ConfigError where one is not an axis (x, y, z, with or without a sign) or both are the
    same.
    """
    z, x = axis_direction(up), axis_direction(front, 'front')
    if z @ x:
        raise ConfigError(f'up and front: on the same axis: expected two, got {up} and {front}')
    return np.array([x, np.cross(z, x), z])


def axis_direction(axis: str, option: str = 'up') -> NDArray[np.float64]:
    """Return the unit vector of an axis by its name, (3,); raises ConfigError on other names."""
    if axis not in _AXES:
        raise ConfigError(f'{option}: not an axis: expected x, y or z, with or without a sign, '
                          f'got {axis!r}')
    return np.array(_AXES[axis], np.float64)


def file_rotation(path: Path, up: str | None, front: str | None) -> NDArray[np.float64]:
    """Return `upright` of a file's axes, (3, 3); None stands for the default of its format."""
    gltf = path.suffix.lower() in GLTF
    return upright(up or ('y' if gltf else 'z'), front or ('z' if gltf else 'x'))


def fit_to_grid(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a copy with its bounding box centred on the origin and its longest side 1."""
    fitted = mesh.copy()
    fitted.apply_translation(-fitted.bounds.mean(axis=0))
    fitted.apply_transform(np.diag([*[1 / fitted.extents.max()] * 3, 1.0]))
    return fitted


def load_mesh(path: Path, up: str | None = None, front: str | None = None) -> trimesh.Trimesh:
    """Return `read_mesh` fitted to the grid; raises as it does."""
    return fit_to_grid(read_mesh(path, up, front))


def read_mesh(path: Path, up: str | None = None, front: str | None = None) -> trimesh.Trimesh:
    """
    Read a mesh in any format of trimesh, rotated to z up and front +x; size and position stay.

    `up` and `front` are the file's axes (for example 'y' and '-z'). By default glTF and GLB are y
    up with the front at +z, as their standard says, other formats z up with the front at +x.
    Vertex colours are sRGB, those of glTF too, whose files have them linear beside a material.
    Raises MeshError where the file is missing, is not a mesh, has no face with an area or faces
    of corners that it lacks, ConfigError on invalid axes.
    """
    rotation = file_rotation(path, up, front)
    if not path.is_file():
        raise MeshError(f'{path}: no such mesh file')
    try:
        mesh = trimesh.load(path, force='mesh', process=False)
    except Exception as error:  # trimesh's readers raise whatever their parser raised
        raise MeshError(f'{path}: no mesh that can be read: {type(error).__name__}: '
                        f'{error}') from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise MeshError(f'{path}: a mesh without faces')
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise MeshError(f'{path}: no mesh that can be read: expected corners 0 to '
                        f'{len(mesh.vertices) - 1} in its faces, got {mesh.faces.min()} to '
                        f'{mesh.faces.max()}')
    if not np.isfinite(mesh.vertices).all() or not mesh.extents.max() > 0 or not mesh.area > 0:
        raise MeshError(f'{path}: no surface: expected faces with finite corners and an area, got '
                        f'extents {mesh.extents}')
    if path.suffix.lower() in GLTF:
        _take_colors(mesh, path)
    transform = np.eye(4)
    transform[:3, :3] = rotation
    mesh.apply_transform(transform)
    return mesh


def _take_colors(mesh: trimesh.Trimesh, path: Path) -> None:
    """Let the mesh have the sRGB colours of a glTF file that has no texture."""
    visual: Any = mesh.visual
    if visual.kind != 'texture':
        return
    if b'"COLOR_0"' in path.read_bytes():
        _take_corner_colors(mesh, path)
        return
    factor = getattr(visual.material, 'baseColorFactor', None)
    if factor is not None and getattr(visual.material, 'baseColorTexture', None) is None:
        # It is light. Where trimesh makes one mesh of several materials, it knows that
        color = from_linear(np.asarray(factor)[:3])
        mesh.visual = trimesh.visual.ColorVisuals(
            mesh, vertex_colors=np.tile(color, (len(mesh.vertices), 1)))


def _take_corner_colors(mesh: trimesh.Trimesh, path: Path) -> None:
    """Let the colours of the corners of a file's parts be the mesh's where none has a texture."""
    # They are lost where trimesh makes one mesh of a file, of its nodes in their order
    scene: Any = trimesh.load(path, force='scene', process=False)
    parts = [scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry]
    parts = [part for part in parts if isinstance(part, trimesh.Trimesh)]
    colors = [found for part in parts if (found := _corner_colors(part)) is not None]
    if len(colors) == len(parts) and sum(map(len, colors)) == len(mesh.vertices):
        mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.concatenate(colors))


def _corner_colors(part: trimesh.Trimesh) -> NDArray[np.uint8] | None:
    """Return the sRGB colours of the corners, (V, 3), of a part of a file; None: a texture."""
    visual: Any = part.visual
    if visual.kind != 'texture':
        return np.asarray(visual.vertex_colors[:, :3], np.uint8)
    factor = getattr(visual.material, 'baseColorFactor', None)
    if getattr(visual.material, 'baseColorTexture', None) is not None:
        return None
    white = np.full((len(part.vertices), 3), 1.0)
    light = visual.vertex_attributes.get('color', white)[:, :3]
    if light.dtype.kind == 'u':
        light = light / np.iinfo(light.dtype).max
    return from_linear(light if factor is None else light * np.asarray(factor)[:3] / 255)
