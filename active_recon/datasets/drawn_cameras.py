"""Cameras as robots hold them, and light as rooms have it: drawn for each object, any of them."""

from dataclasses import dataclass
import hashlib
import math

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import AZIMUTHS, Camera, Intrinsics, orbit_camera, TURN
from active_recon.geometry.framing import cube_corners
import numpy as np
from numpy.typing import NDArray

KINDS = ('turntable', 'any')
LOWEST, HIGHEST = math.radians(-10), math.radians(85)
_SIDE = 160  # pixels of an image
_FOCAL = (0.8, 3.0)  # image sides
_FILLED = (0.55, 1.1)  # of the image's side by the cube
_OFF_CENTRE = 0.1  # of the image's side
_ROLL = math.radians(10)
_NEAREST = 1.05  # sides of the cube: its corners reach 0.87
_LIGHT_STRAYS = 0.35  # how far light strays from the shoulder


@dataclass(frozen=True)
class Viewing:
    """
    From where an object is seen, and how it stands.

    - cameras: 'turntable' (24 azimuths, elevation 30 degrees), or 'any' (drawn by the object's
      name: any azimuth, elevation -10 to 85 degrees, roll, distance and lens)
    - count: how many are drawn
    - turned: every other object stands at any yaw instead of its front at +x
    """

    cameras: str = 'turntable'
    count: int = 12
    turned: bool = False

    def __post_init__(self) -> None:
        """Reject what nothing is seen from."""
        if self.cameras not in KINDS or not 1 <= self.count <= 99:
            raise ConfigError('cameras: unknown kind or wrong number of views: expected one of '
                              f'{", ".join(KINDS)}, and 1 to 99 views, got {self.cameras!r} and '
                              f'{self.count}')

    def yaw(self, name: str) -> float:
        """Return the yaw at which an object of a name stands, radians."""
        rng = _generator(name, 'yaw')
        return float(rng.uniform(0, TURN)) if self.turned and rng.random() < 0.5 else 0.0

    def of(self, name: str) -> tuple[list[Camera], list[NDArray[np.float64] | None]]:
        """Return the cameras of an object of a name, and each one's light; see `render`."""
        if self.cameras == 'turntable':
            return [orbit_camera(azimuth) for azimuth in AZIMUTHS], [None] * len(AZIMUTHS)
        rng = _generator(name, 'cameras')
        cameras = [draw_camera(rng) for _ in range(self.count)]
        shoulder = np.array([-0.45, -0.65, -0.61]) + rng.normal(0, _LIGHT_STRAYS, 3)
        return cameras, [shoulder / np.linalg.norm(shoulder)] * self.count


TURNTABLE = Viewing()
"""24 azimuths from a fixed camera."""


def draw_camera(rng: np.random.Generator) -> Camera:
    """
    Return a camera that sees the unit cube about the origin, or most of it.

    It looks a little beside the cube's centre, rolled a little; its distance is what lets the
    cube fill from half of the image to somewhat more than all of it under the focal length.
    """
    sine = rng.uniform(math.sin(LOWEST), math.sin(HIGHEST))
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
    Return how far off the unit cube fills a share of the image, or the least there may be.

    `towards` looks at the origin; `focal` counts in sides of the image.
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
