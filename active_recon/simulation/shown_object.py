"""An object in front of the simulated camera: images around it and their cameras."""

from dataclasses import dataclass
from pathlib import Path

from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import DataError
from active_recon.geometry.cameras import AZIMUTHS, Camera, nearest_view, orbit_camera
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ShownObject:
    """Images, (H, W, 3) uint8 RGB each, and their cameras in the object frame, metres."""

    name: str
    images: list[NDArray[np.uint8]]
    cameras: list[Camera]

    def seen_from(self, azimuth: float) -> tuple[NDArray[np.uint8], Camera]:
        """Return the image nearest to an azimuth (radians), and its own camera."""
        index = nearest_view(azimuth, [camera.azimuth for camera in self.cameras])
        return self.images[index], self.cameras[index]


def rendered_object(path: Path, object_size: float = 1.0, background: float = 255.0,
                    up: str | None = None, front: str | None = None) -> ShownObject:
    """
    Return renderings of a mesh from 24 azimuths, its longest side `object_size` metres.

    `background` is a grey in [0, 255]. For `up`, `front` and errors, see `read_mesh`.
    """
    renderer = Renderer(load_mesh(path, up, front))
    cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
    images = [composite(renderer.render(camera), background) for camera in cameras]
    return ShownObject(path.name, images, [_scaled(camera, object_size) for camera in cameras])


def stored_object(folder: ObjectFolder, object_size: float = 1.0,
                  background: float = 255.0) -> ShownObject:
    """
    Return an object of a dataset in R2N2's layout, with a grid of `object_size` metres a side.

    `background` is a grey in [0, 255]. Raises DataError where the object cannot be read.
    """
    cameras = folder.cameras()
    if not cameras:
        raise DataError(f'{folder.images_folder}: no views: expected one or more, got none')
    images = [composite(folder.image(index), background) for index in range(len(cameras))]
    return ShownObject(f'{folder.category}/{folder.name}', images,
                       [_scaled(camera, object_size) for camera in cameras])


def _scaled(camera: Camera, size: float) -> Camera:
    pose = camera.pose.copy()
    pose[:3, 3] *= size
    return Camera(pose, camera.intrinsics)
