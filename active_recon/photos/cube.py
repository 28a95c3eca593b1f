"""The object's cube in the world of the camera file, and a first guess of it from the cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray

MARGIN = 1.09
"""Side of a cube, relative to the longest side of the object's box, that has room around it."""

FIT = 1.0
"""The same of a cube that is found: networks were trained in cubes that objects fill."""
_LEAST_ANGLE_SHARE = 1e-3
WIDER, NARROWER = 1.6, 0.75
"""
Side of the first cube relative to the photos' width: wider than they are, or as a segmenter or the
network need it, to which a photo that is small in the cube's image is all object.
"""
_OF_DISTANCE = 1.1  # the cube's corners are 0.87 sides away from its centre


@dataclass(frozen=True, eq=False)
class Cube:
    """
    A cube in the world of the camera file: its centre (3,), its side, and what points up (3,).

    It is upright. The object frame has its origin at the centre and z up; its yaw is arbitrary.
    Raises ConfigError where the side is not above 0, or a number is not finite.
    """

    centre: NDArray[np.float64]
    side: float
    up: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Reject what is no cube."""
        if not 0 < self.side < np.inf or not np.isfinite(self.centre).all():
            raise ConfigError('box: no cube: expected finite x, y, z and a side above 0, got '
                              f'{self.centre.tolist()} and {self.side}')
        if not np.linalg.norm(self.up) > 0:
            raise ConfigError(f'up: no direction: expected one, got {self.up.tolist()}')

    @classmethod
    def around(cls, box: NDArray[np.float64], up: NDArray[np.float64]) -> 'Cube':
        """Return the cube about a box, least and greatest corner (2, 3), with a margin."""
        return cls(box.mean(axis=0), MARGIN * float(np.ptp(box, axis=0).max()), up)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Object frame from world, (3, 3): `up` becomes z, the axis farthest from it turns x."""
        return upright(self.up)

    def camera(self, camera: Camera, size: float) -> Camera:
        """Return a camera of the world in the object frame, where the cube's side is `size`."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation @ camera.pose[:3, :3]
        pose[:3, 3] = self.rotation @ (camera.position - self.centre) * (size / self.side)
        return Camera(pose, camera.intrinsics)

    def world_from_object(self, size: float) -> NDArray[np.float64]:
        """Return the similarity, (4, 4), from the object frame with a cube of side `size`."""
        found = np.eye(4)
        found[:3, :3] = self.rotation.T * (self.side / size)
        found[:3, 3] = self.centre
        return found

    def part(self, box: NDArray[np.float64], margin: float = MARGIN) -> 'Cube':
        """Return the cube about a box in sides of this cube, from its centre, (2, 3)."""
        centre = self.centre + self.rotation.T @ box.mean(axis=0) * self.side
        return Cube(centre, margin * float(np.ptp(box, axis=0).max()) * self.side, self.up)


def upright(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return x, y, z of an upright frame, (3, 3): `up` is z, the axis farthest from it turns x."""
    z = up / np.linalg.norm(up)
    axis = np.eye(3)[int(np.abs(z).argmin())]
    x = axis - z * (z @ axis)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def shown_width(camera: Camera, point: NDArray[np.float64]) -> float:
    """Return how wide a part a camera shows at a point, along the shorter side of its image."""
    lens = camera.intrinsics
    return float(np.linalg.norm(camera.position - point)) * min(
        lens.width / lens.fx, lens.height / lens.fy)


def meeting_point(cameras: Sequence[Camera]) -> NDArray[np.float64]:
    """
    Return the point with the least sum of squared distances from all optical axes, (3,).

    Raises DataError where the axes are parallel, or there is only one.
    """
    normal, moment = np.zeros((3, 3)), np.zeros(3)
    for camera in cameras:
        forward = camera.pose[:3, 2]
        across = np.eye(3) - np.outer(forward, forward)
        normal += across
        moment += across @ camera.position
    if np.linalg.eigvalsh(normal)[0] < _LEAST_ANGLE_SHARE * len(cameras):
        raise DataError('object not found: expected photos from several directions, got '
                        f'{len(cameras)} that look the same way; give its place by --box',
                        'no_cube')
    return np.asarray(np.linalg.solve(normal, moment))


def first_cube(cameras: Sequence[Camera], up: NDArray[np.float64],
               share: float = WIDER) -> Cube:
    """
    Return a cube where the optical axes meet, of a share of the photos' width at that place.

    It is wider than the photos by default: an object may fill them. All cameras stay outside of
    the cube. Raises DataError as `meeting_point` does.
    """
    centre = meeting_point(cameras)
    distances = [float(np.linalg.norm(camera.position - centre)) for camera in cameras]
    widths = [shown_width(camera, centre) for camera in cameras]
    side = min(share * float(np.median(widths)), _OF_DISTANCE * min(distances))
    return Cube(centre, side, up)


def upward(poses: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """
    Return the mean of what is up in the photos of poses (4, 4), (3,).

    It is z where they contradict each other.
    """
    mean = -np.mean([pose[:3, 1] for pose in poses], axis=0)
    length = float(np.linalg.norm(mean))
    return np.asarray(mean / length) if length > 0.1 else np.array([0.0, 0.0, 1.0])
