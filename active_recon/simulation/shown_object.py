"""An object in front of the simulated camera: images around it, or one rendered from anywhere."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import DataError
from active_recon.geometry.cameras import (
    AZIMUTHS,
    Camera,
    CANONICAL_ELEVATION,
    nearest_view,
    orbit_camera,
)
from active_recon.geometry.view_distance import nearest_camera
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
import numpy as np
from numpy.typing import NDArray


class Shown(Protocol):
    """An object that a simulated camera sees."""

    @property
    def name(self) -> str: ...

    def seen_from(self, azimuth: float, elevation: float | None = None
                  ) -> tuple[NDArray[np.uint8], Camera]:
        """
        Return the image from a place, radians, (H, W, 3) uint8 RGB, and its camera.

        The camera's place may be another, for lack of an image there. `elevation` None: any.
        """
        ...


@dataclass(frozen=True, eq=False)
class ShownObject:
    """Images, (H, W, 3) uint8 RGB each, and their cameras in the object frame, metres."""

    name: str
    images: list[NDArray[np.uint8]]
    cameras: list[Camera]

    def seen_from(self, azimuth: float, elevation: float | None = None
                  ) -> tuple[NDArray[np.uint8], Camera]:
        """Return the image nearest to a place, and its own camera; see Shown."""
        if elevation is None:
            index = nearest_view(azimuth, [camera.azimuth for camera in self.cameras])
        else:
            index = nearest_camera(orbit_camera(azimuth, elevation), self.cameras)
        return self.images[index], self.cameras[index]


class RenderedAnywhere:
    """A mesh that is rendered from wherever it is seen, as a turntable's camera would be held."""

    def __init__(self, name: str, renderer: Renderer, object_size: float,
                 background: float) -> None:
        self.name = name
        self._renderer = renderer
        self._size = object_size
        self._background = background
        self._last: tuple[float, float] | None = None

    def seen_from(self, azimuth: float, elevation: float | None = None
                  ) -> tuple[NDArray[np.uint8], Camera]:
        """Return the image from a place, and its camera; see Shown."""
        place = azimuth, CANONICAL_ELEVATION if elevation is None else elevation
        if place != self._last:  # a camera that rests sees the same
            camera = orbit_camera(*place)
            self._last = place
            self._image = composite(self._renderer.render(camera), self._background)
            self._camera = _scaled(camera, self._size)
        return self._image, self._camera


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


def object_anywhere(path: Path, object_size: float = 1.0, background: float = 255.0,
                    up: str | None = None, front: str | None = None) -> RenderedAnywhere:
    """Return a mesh to be rendered from anywhere; arguments and errors of `rendered_object`."""
    return RenderedAnywhere(
        path.name, Renderer(load_mesh(path, up, front)), object_size, background)


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
    return ShownObject(folder.full_name, images,
                       [_scaled(camera, object_size) for camera in cameras])


def _scaled(camera: Camera, size: float) -> Camera:
    pose = camera.pose.copy()
    pose[:3, 3] *= size
    return Camera(pose, camera.intrinsics)
