"""Mesh files: metres, the origin of the object frame; z up, in GLB y up as its standard says."""

from pathlib import Path
from typing import Any, TYPE_CHECKING

from active_recon.errors import ConfigError
from active_recon.volumes.srgb import to_linear
from active_recon.whole_files import whole_file
import numpy as np

if TYPE_CHECKING:
    import trimesh

MESH_FORMATS = ('ply', 'obj', 'stl', 'glb')
"""Suffixes of mesh files; STL has no colours."""
_GLTF_FROM_OBJECT = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64)
_DULL = {'pbrMetallicRoughness': {'metallicFactor': 0.0}}
"""The material of meshes in GLB: what has none is bare metal, black where nothing is mirrored."""


def mesh_suffix(path: Path, formats: tuple[str, ...] = MESH_FORMATS) -> str:
    """Return a file's suffix in small letters, without the dot; ConfigError if no format's."""
    suffix = path.suffix.lower().lstrip('.')
    if suffix not in formats:
        raise ConfigError(f'{path}: no mesh has that suffix: expected {", ".join(formats)}')
    return suffix


def write_mesh(mesh: 'trimesh.Trimesh', path: Path) -> None:
    """
    Write a mesh of the object frame as PLY, OBJ, STL or GLB, by the file's suffix.

    Vertex colours, sRGB, go with it, but for STL. In GLB y is up, the front is +z, and colours are
    linear, as glTF says; what else reads and writes meshes here does the same. The file appears
    whole. Raises ConfigError on other suffixes.
    """
    suffix = mesh_suffix(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    content: Any = glb(_y_up(mesh)) if suffix == 'glb' else mesh.export(file_type=suffix)
    with whole_file(path) as unfinished:
        unfinished.write_bytes(content.encode() if isinstance(content, str) else content)


def glb(mesh: 'trimesh.Trimesh') -> bytes:
    """Return a mesh as GLB in the axes that it has, its vertex colours, sRGB, as glTF says."""
    lit: Any = mesh.copy()
    if lit.visual.kind in ('vertex', 'face'):
        colors = np.array(lit.visual.vertex_colors)
        colors[:, :3] = to_linear(colors[:, :3])
        lit.visual.vertex_colors = colors
    content: bytes = lit.export(file_type='glb', tree_postprocessor=_make_dull)
    return content


def _make_dull(tree: dict[str, Any]) -> None:
    if not tree.get('materials'):
        tree['materials'] = [_DULL]
        for part in tree['meshes']:
            for primitive in part['primitives']:
                primitive['material'] = 0


def _y_up(mesh: 'trimesh.Trimesh') -> 'trimesh.Trimesh':
    turned = mesh.copy()
    turned.apply_transform(_GLTF_FROM_OBJECT)
    return turned
