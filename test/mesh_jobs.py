"""Jobs that make meshes or fail to, for processes that need not import torch for them."""

from collections.abc import Callable
import os
from pathlib import Path

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.making import Job
from active_recon.errors import MeshError
from active_recon.shapes import make_shape
import trimesh


def job(name: str, make: Callable[[], trimesh.Trimesh]) -> Job:
    return Job(ObjectFolder(Path('meshes'), 'part', name), make)


def a_box() -> trimesh.Trimesh:
    return make_shape('speaker', 1)


def no_mesh(name: str) -> trimesh.Trimesh:
    raise MeshError(f'{name}: a mesh without faces')


def a_death() -> trimesh.Trimesh:
    os._exit(3)
