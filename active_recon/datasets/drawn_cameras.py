"""Cameras and light for rendering an object: a turntable's, a dome's, or drawn at random."""

from dataclasses import dataclass
import hashlib
import math

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import AZIMUTHS, Camera, Intrinsics, orbit_camera, TURN
from active_recon.geometry.framing import cube_corners
from active_recon.volumes.hidden import LOWEST
import numpy as np
from numpy.typing import NDArray

KINDS = ('turntable', 'dome', 'any')
DOME_AZIMUTHS: NDArray[np.float64] = AZIMUTHS[::2]
DOME_ELEVATIONS = tuple(map(math.radians, (10, 30, 50, 70)))
_HIGHEST = math.radians(85)
_SIDE = 160  # pixels of an image
_FOCAL = (0.8, 3.0)  # focal length, in image sides
_FILLED = (0.55, 1.1)  # extent of the cube in the image, in image sides
_OFF_CENTRE = 0.1  # offset of the cube's centre in the image, in image sides
_ROLL = math.radians(10)
_NEAREST = 1.05  # distance in sides of the cube, whose corners are at 0.87
_LIGHT_SPREAD = 0.35  # standard deviation of the light's direction, as a unit vector's parts


@dataclass(frozen=True)
class Viewing:
    """
    The cameras that an object is rendered from, and the object's yaw.

    - cameras: 'turntable' (24 azimuths, elevation 30 degrees), 'dome' (12 azimuths at each of
      four elevations, 10 to 70 degrees) or 'any' (random azimuth, elevation from -10 to 85
      degrees, roll, distance and focal length, seeded by the object's name)
    - count: number of cameras of kind 'any', 1 to 99
    - turned: half of the objects get a random yaw, the others keep their front at +x

    Raises ConfigError on any other kind or count.
    """

    cameras: str = 'turntable'
    count: int = 12
    turned: bool = False

    def __post_init__(self) -> None:
        """Reject unknown kinds and counts out of range."""
        if self.cameras not in KINDS or not 1 <= self.count <= 99:
            raise ConfigError('cameras: unknown kind or wrong number of views: expected one of '
                              f'{", ".join(KINDS)}, and 1 to 99 views, got {self.cameras!r} and '
                              f'{self.count}')

    def yaw(self, name: str) -> float:
        """Return the yaw of the object with this name, radians in [0, 2 pi)."""
        rng = _generator(name, 'yaw')
        return float(rng.uniform(0, TURN)) if self.turned and rng.random() < 0.5 else 0.0

    def of(self, name: str) -> tuple[list[Camera], list[NDArray[np.float64] | None]]:
        """
        Return the cameras of the object with this name, and for each the direction of the light.

        A direction is a unit vector (3,) in the optical frame, None for the renderer's default.
        """
        if self.cameras == 'turntable':
            return [orbit_camera(azimuth) for azimuth in AZIMUTHS], [None] * len(AZIMUTHS)
        if self.cameras == 'dome':
            dome: list[Camera] = [orbit_camera(azimuth, elevation)
                                  for elevation in DOME_ELEVATIONS for azimuth in DOME_AZIMUTHS]
            return dome, [None] * len(dome)
        rng = _generator(name, 'cameras')
        cameras = [draw_camera(rng) for _ in range(self.count)]
        light = np.array([-0.45, -0.65, -0.61]) + rng.normal(0, _LIGHT_SPREAD, 3)
        return cameras, [light / np.linalg.norm(light)] * self.count


TURNTABLE = Viewing()
"""The 24 azimuths of a turntable in front of a fixed camera."""


def draw_camera(rng: np.random.Generator) -> Camera:
    """
    Return a random camera that sees all or most of the unit cube around the origin.

    It looks slightly past the cube's centre, with a small roll. Its distance follows from the
    focal length, so that the cube's extent is 0.55 to 1.1 sides of the image.
    """
    sine = rng.uniform(math.sin(LOWEST), math.sin(_HIGHEST))
    focal = float(np.exp(rng.uniform(*np.log(_FOCAL))))
    towards = orbit_camera(rng.uniform(0, TURN), math.asin(sine), 1.0)
    distance = filling_distance(towards, focal, rng.uniform(*_FILLED))
    aside = np.arctan(rng.uniform(-_OFF_CENTRE, _OFF_CENTRE, 2) / focal)
    roll = float(np.clip(rng.normal(0, _ROLL / 2), -_ROLL, _ROLL))
    pose = towards.scaled(distance).pose.copy()
    pose[:3, :3] = pose[:3, :3] @ _rotation(1, aside[0]) @ _rotation(0, aside[1]) @ _rotation(
        2, roll)
    pixels = focal * _SIDE
    return Camera(pose, Intrinsics(pixels, pixels, _SIDE / 2, _SIDE / 2, _SIDE, _SIDE))


def filling_distance(towards: Camera, focal: float, share: float) -> float:
    """
    Return the distance at which the unit cube extends over `share` of the image, at least 1.05.

    `towards` is a camera that looks at the origin; `focal` is in sides of the image, the distance
    in sides of the cube. Found by bisection.
    """
    corners = cube_corners() @ towards.pose[:3, :3]
    near, far = _NEAREST, 100.0
    for _ in range(40):
        middle = (near + far) / 2
        extent = np.abs(corners[:, :2] / (corners[:, 2:] + middle)).max()
        near, far = (middle, far) if 2 * focal * extent > share else (near, middle)
    return near


def _generator(name: str, purpose: str) -> np.random.Generator:
    digest = hashlib.sha256(f'{purpose}/{name}'.encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], 'big'))


def _rotation(axis: int, angle: float) -> NDArray[np.float64]:
    """Return the rotation about an axis of the optical frame, (3, 3)."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[first, first] = turn[second, second] = math.cos(angle)
    turn[second, first], turn[first, second] = math.sin(angle), -math.sin(angle)
    return turn
