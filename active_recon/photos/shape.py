"""A reconstructed shape: cells, mesh, quality, and what it was made from."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from active_recon.geometry.cameras import Camera
from active_recon.meshes.coloring import colored
from active_recon.meshes.photos import album_of
from active_recon.photos.cube import Cube
from active_recon.photos.ground import Ground
from active_recon.quality.quality import Quality
from active_recon.reconstructor import Reconstruction
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.refinement import refined_mesh
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class TakenView:
    """
    A photo that was taken into the reconstruction.

    - image: as the network was shown it, (H, W, 3) uint8 RGB; camera: in the object frame, metres
    - background: what removed the background, see `shown_image`
    - known: the reconstruction after it; depth: what it took in beside the image, or None
    """

    name: str
    image: NDArray[np.uint8]
    camera: Camera
    background: str
    known: Reconstruction
    depth: DepthImage | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """
    The shape of an object, in the object frame: z up, origin at the centre of its cube, metres.

    - grid: its occupancy; cells above `threshold` are occupied
    - views: the photos it was made from; left_out: why others were not used
    - cube: the object's place in the world of the camera file
    - ground: the board or table that it stands on, in the same world; None: none was found
    - background: in words, where the silhouettes are from
    - provenance: hashes and runtime of the network
    """

    grid: VoxelGrid
    threshold: float
    views: Sequence[TakenView]
    cube: Cube
    ground: Ground | None
    background: str
    left_out: Sequence[str] = ()
    warnings: Sequence[str] = ()
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def occupancy(self) -> NDArray[np.float32]:
        """The occupancy of each cell, (R, R, R) in [0, 1], indexed [x, y, z]."""
        return self.grid.occupancy

    @property
    def size(self) -> float:
        """Side of the cube, metres."""
        return self.grid.size

    @property
    def quality(self) -> Quality | None:
        """How good the shape is, as judged without the truth; None without quality tables."""
        return self.views[-1].known.quality

    @property
    def world_from_object(self) -> NDArray[np.float64]:
        """The similarity, (4, 4), that carries the mesh into the world of the camera file."""
        return self.cube.world_from_object(self.size)

    def mesh(self) -> 'trimesh.Trimesh':
        """
        Return the closed surface, metres, in the colours of the photos.

        Raises DataError where no cell is occupied.
        """
        return self._surface.copy()

    @cached_property
    def _surface(self) -> 'trimesh.Trimesh':
        album = album_of([(view.image, view.camera) for view in self.views], self.size)
        return colored(refined_mesh(self.grid, self.threshold), album.photos)
