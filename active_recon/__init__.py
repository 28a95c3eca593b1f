"""
Active 3D reconstruction of an object from few camera views.

What a notebook needs, each imported when it is first asked for:

>>> import numpy as np
>>> from active_recon import load, orbit_camera, Planner
>>> reconstructor, planner = load(), Planner.load('farthest', max_views=2)
>>> image, camera = np.full((137, 137, 3), 255, np.uint8), orbit_camera(azimuth=0.5)
>>> known = reconstructor.add_view(image, camera)
>>> known.grid.occupancy.ndim, known.grid.size
(3, 1.0)
>>> decision = planner.add_view(known.latent, camera, known.grid.entropy())
>>> 3.0 < abs(decision.goal.camera.azimuth - camera.azimuth) < 3.3  # radians: the other side
True
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
    from active_recon.photos.reconstruct import reconstruct
    from active_recon.planner import Planner
    from active_recon.reconstructor import load, Reconstructor
    from active_recon.volumes.refinement import refined_mesh
    from active_recon.volumes.voxels import VoxelGrid

__version__ = '0.1.0'
__all__ = ['Camera', 'Intrinsics', 'Planner', 'Reconstructor', 'VoxelGrid', 'load', 'orbit_camera',
           'reconstruct', 'refined_mesh']
_MODULES = {
    'Camera': 'geometry.cameras', 'Intrinsics': 'geometry.cameras',
    'orbit_camera': 'geometry.cameras', 'Planner': 'planner', 'Reconstructor': 'reconstructor',
    'load': 'reconstructor', 'VoxelGrid': 'volumes.voxels',
    'reconstruct': 'photos.reconstruct', 'refined_mesh': 'volumes.refinement'}


def __getattr__(name: str) -> Any:
    """Import what is asked for; torch comes with the first network."""
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)


def __dir__() -> list[str]:
    """Return what there is, without importing it."""
    return sorted([*globals(), *__all__])
