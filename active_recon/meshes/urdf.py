"""A shape as a robot description: a URDF file, and its meshes in a folder beside it."""

from collections.abc import Sequence
from pathlib import Path
import re
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from active_recon.errors import ConfigError
from active_recon.meshes.collision import convex_parts
from active_recon.meshes.files import write_mesh
from active_recon.whole_files import unfinished_folder, whole_file
import numpy as np
from numpy.typing import NDArray
import trimesh

DENSITY = 500.0
"""Mass of a cubic metre, kg, where none is given: of wood, or a thing with air in it."""


def write_urdf(mesh: trimesh.Trimesh, path: Path, density: float = DENSITY) -> str:
    """
    Write a closed mesh (metres, object frame) as the one link of a URDF file.

    `NAME.urdf` comes with the folder `NAME_meshes`: the mesh with its colours (OBJ) and the
    convex parts of its collision shape (STL, see `convex_parts`). The link's frame is frame
    `object`; mass and inertia are those of a solid of that density, kg/m^3. Returns in words what
    is missing, or ''. Raises ConfigError where the density is not above 0.
    """
    if not 0 < density < np.inf:
        raise ConfigError(f'density: out of range: expected kg/m^3 above 0, got {density:g}')
    folder = path.with_name(f'{path.stem}_meshes')
    parts, missing = convex_parts(mesh)
    names = [f'collision_{number}.stl' for number in range(len(parts))]
    name = re.sub(r'\W', '_', path.stem)
    robot = _robot(name, mesh, density, [Path(folder.name, each) for each in names],
                   Path(folder.name, 'visual.obj'))
    ElementTree.indent(robot)
    folder.mkdir(parents=True, exist_ok=True)
    # What stood there is left until all of the new is on the disk
    with unfinished_folder(folder) as unfinished, whole_file(path) as description:
        description.write_text(
            f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, "unicode")}\n')
        for part, each in zip((mesh, *parts), ('visual.obj', *names), strict=True):
            write_mesh(part, unfinished / each)
        for stale in folder.glob('collision_*.stl'):
            stale.unlink()
        for file in unfinished.iterdir():
            file.replace(folder / file.name)
    return missing


def _robot(name: str, mesh: trimesh.Trimesh, density: float, collisions: Sequence[Path],
           visual: Path) -> Element:
    robot = Element('robot', name=name)
    link = SubElement(robot, 'link', name=name)
    weighed = mesh.copy()
    weighed.density = density
    inertial = SubElement(link, 'inertial')
    SubElement(inertial, 'origin', xyz=_numbers(weighed.center_mass), rpy='0 0 0')
    SubElement(inertial, 'mass', value=f'{weighed.mass:.9g}')
    about = weighed.moment_inertia  # about the centre of mass
    SubElement(inertial, 'inertia', {
        f'i{"xyz"[row]}{"xyz"[column]}': f'{about[row, column]:.9g}'
        for row in range(3) for column in range(row, 3)})
    for kind, files in (('visual', [visual]), ('collision', collisions)):
        for file in files:
            shown = SubElement(link, kind)
            SubElement(SubElement(shown, 'geometry'), 'mesh', filename=file.as_posix())
    return robot


def _numbers(values: NDArray[np.float64]) -> str:
    return ' '.join(f'{value:.9g}' for value in values)
