"""
Cameras around an object: azimuth and elevation to pose, intrinsics, projection.

Frames follow REP-103. The object frame is right-handed with z up, its origin the centre of the
voxel grid. A camera's pose is that of its optical frame: z forward, x right, y down. Azimuth is
counter-clockwise about +z from +x.
"""

from dataclasses import dataclass
from functools import lru_cache
import math
from typing import TypeVar

from active_recon.errors import ViewError
from active_recon.geometry.lenses import Distortion
import numpy as np
from numpy.typing import ArrayLike, NDArray

TURN = 2 * math.pi
OBJECT_FRAME = 'object'
VIEW_COUNT = 24
AZIMUTHS: NDArray[np.float64] = np.arange(VIEW_COUNT) * TURN / VIEW_COUNT
"""Azimuths of the rendered views, radians, (24,)."""
CANONICAL_ELEVATION = math.radians(30)
ELEVATION_TOLERANCE = math.radians(5)
"""Deviation from the canonical elevation beyond which there is a warning: not trained on."""
CANONICAL_DISTANCE = 2.1
"""Distance of the canonical camera in sides of the voxel grid: the grid's sphere just fits."""
_KEPT_PIXELS = 1 << 20


_Azimuth = TypeVar('_Azimuth', float, NDArray[np.float64])


def wrap_azimuth(azimuth: _Azimuth) -> _Azimuth:
    """Return the azimuth, or azimuths, in [0, 2 pi)."""
    return azimuth % TURN % TURN  # -1e-20 % TURN rounds up to TURN itself


def whole_degrees(azimuth: float) -> int:
    """Return an azimuth in radians as whole degrees, in [0, 360)."""
    return round(math.degrees(azimuth)) % 360


def azimuth_difference(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return a minus b, the short way round, in [-pi, pi); shapes broadcast."""
    apart = np.asarray(a, np.float64) - np.asarray(b, np.float64)
    return np.asarray((apart + math.pi) % TURN - math.pi)


def nearest_view(azimuth: float, azimuths: ArrayLike = AZIMUTHS) -> int:
    """Return the index of the azimuth with the smallest wrapped difference, radians."""
    return int(np.argmin(np.abs(azimuth_difference(azimuths, azimuth))))


@dataclass(frozen=True)
class Intrinsics:
    """
    Camera intrinsics: focal lengths, principal point and image size in pixels, and distortion.

    Pixel coordinates are (0.5, 0.5) at the centre of the first pixel. `distortion` is None for a
    pinhole camera. Raises ViewError on numbers that no camera has.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: Distortion | None = None

    def __post_init__(self) -> None:
        """Reject focal lengths and sizes that are not above 0, and what is not finite."""
        if not isinstance(self.distortion, Distortion | None):
            raise ViewError('invalid distortion: expected a Distortion of '
                            'active_recon.geometry.lenses, with its model, got a '
                            f'{type(self.distortion).__name__}', 'camera_info')
        if not (0 < self.fx < math.inf and 0 < self.fy < math.inf and self.width > 0
                and self.height > 0 and math.isfinite(self.cx) and math.isfinite(self.cy)):
            raise ViewError('invalid intrinsics: expected focal lengths and sizes above 0 and a '
                            f'finite centre, got fx {self.fx}, fy {self.fy}, cx {self.cx}, cy '
                            f'{self.cy}, {self.width} x {self.height}', 'camera_info')

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The camera matrix K, (3, 3), of the paper's section 3.2; without distortion."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], np.float64)

    def resized(self, width: int, height: int) -> 'Intrinsics':
        """Return the intrinsics of the same lens for an image resized to this size, in pixels."""
        across, down = width / self.width, height / self.height
        return Intrinsics(self.fx * across, self.fy * down, self.cx * across, self.cy * down,
                          width, height, self.distortion)

    def reduced(self, by: int) -> 'Intrinsics':
        """
        Return the intrinsics of an image in which `by` x `by` pixels are one.

        What is left over at the right and at the bottom fills pixels of its own, as in a JPEG
        image that is decoded smaller.
        """
        if by == 1:
            return self
        return Intrinsics(self.fx / by, self.fy / by, self.cx / by, self.cy / by,
                          -(-self.width // by), -(-self.height // by), self.distortion)

    def pixels_of(self, x: NDArray[np.float64], y: NDArray[np.float64]
                  ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the pixel coordinates of what is at x right and y down at depth 1, (...) each."""
        if self.distortion is not None:
            x, y = self.distortion.distorted(x, y)
        return x * self.fx + self.cx, y * self.fy + self.cy


_EYE, _LAST_ROW = np.eye(3), np.array([0.0, 0, 0, 1])
_FOCAL = 35 / 32 * 137  # R2N2's lens and sensor, verified by reprojection
CANONICAL_INTRINSICS = Intrinsics(_FOCAL, _FOCAL, 68.5, 68.5, 137, 137)


@dataclass(frozen=True, eq=False)
class Camera:
    """
    A pose in the object frame, (4, 4) object from optical frame in metres, and the intrinsics.

    The pose is copied. Raises ViewError unless the pose is finite, its rotation a rotation, and
    its last row 0, 0, 0, 1.
    """

    pose: NDArray[np.float64]
    intrinsics: Intrinsics = CANONICAL_INTRINSICS

    def __post_init__(self) -> None:
        """Reject a pose that is not rigid."""
        # Its own, so that a buffer that is filled anew moves no camera of before
        object.__setattr__(self, 'pose', np.array(self.pose, np.float64))
        if self.pose.shape != (4, 4) or not np.isfinite(self.pose).all():
            raise ViewError('invalid camera pose: expected a finite 4 x 4 matrix, '
                            f'got\n{self.pose}', 'pose')
        rotation = self.pose[:3, :3]
        # Not by allclose, which takes longer than all else of a plan's candidates
        if (np.abs(rotation @ rotation.T - _EYE).max() > 1e-4
                or np.linalg.det(rotation) < 0):  # a reflection
            raise ViewError('invalid camera pose: expected a rotation in it, '
                            f'got\n{rotation}', 'pose')
        if np.abs(self.pose[3] - _LAST_ROW).max() > 1e-4:
            raise ViewError('invalid camera pose: expected 0, 0, 0, 1 as its last row, got '
                            f'{self.pose[3]}; is it transposed?', 'pose')

    @property
    def position(self) -> NDArray[np.float64]:
        """Optical centre in the object frame, metres, (3,)."""
        return self.pose[:3, 3]

    @property
    def distance(self) -> float:
        """Distance from the object frame's origin, metres."""
        return float(np.linalg.norm(self.position))

    @property
    def azimuth(self) -> float:
        """Radians in [0, 2 pi), counter-clockwise about +z from +x."""
        return wrap_azimuth(math.atan2(self.position[1], self.position[0]))

    @property
    def elevation(self) -> float:
        """Angle above the horizon, radians in [-pi/2, pi/2]."""
        across = math.hypot(self.position[0], self.position[1])
        return math.atan2(self.position[2], across)

    @property
    def direction(self) -> NDArray[np.float64]:
        """Unit vector from the object frame's origin to the camera, (3,)."""
        return self.position / self.distance

    def turned(self, yaw: float) -> 'Camera':
        """Return the camera rotated by `yaw` counter-clockwise about +z, radians."""
        if yaw == 0:
            return self
        turn = np.eye(4)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
        return Camera(turn @ self.pose, self.intrinsics)

    def scaled(self, factor: float) -> 'Camera':
        """Return the camera at `factor` times its distance, in the same direction."""
        if factor == 1:
            return self
        pose = self.pose.copy()
        pose[:3, 3] *= factor
        return Camera(pose, self.intrinsics)

    @property
    def object_to_camera(self) -> NDArray[np.float64]:
        """[R t; 0 1] of the paper's section 3.2, (4, 4): the inverse of the pose."""
        rotation, position = self.pose[:3, :3], self.pose[:3, 3]
        inverse = np.eye(4)
        inverse[:3, :3] = rotation.T
        inverse[:3, 3] = -rotation.T @ position
        return inverse

    def project(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """
        Project points of the object frame, P^s ~ T P^w (section 3.2).

        Takes (N, 3) metres; returns pixels (N, 2), where the centre of the first pixel is
        (0.5, 0.5), and depths along the optical axis (N,) in metres. The pixels of points behind
        the camera (a depth of 0 or less) are meaningless.
        """
        transform = self.object_to_camera
        # (3, N): what is done to a coordinate runs through memory in order
        optical = transform[:3, :3] @ np.asarray(points, np.float64).T + transform[:3, 3:]
        if self.intrinsics.distortion is not None:
            x, y = optical[:2] / np.where(optical[2] > 0, optical[2], np.nan)
            return np.stack(self.intrinsics.pixels_of(x, y), axis=1), optical[2]
        image = self.intrinsics.matrix @ optical
        with np.errstate(divide='ignore', invalid='ignore'):
            return (image[:2] / image[2]).T, optical[2]

    def ray_directions(self, samples: int = 1, window: tuple[int, int, int, int] | None = None
                       ) -> NDArray[np.float64]:
        """
        Return rays through the pixels in the object frame, (height, width, 3), of depth 1.

        With `samples` there are samples x samples rays in each pixel: (samples x height, samples
        x width, 3). `window`, (left, top, right, bottom) in pixels, asks for the rays through
        those alone.
        """
        width, height = self.intrinsics.width, self.intrinsics.height
        lens = self.intrinsics.resized(width * samples, height * samples)
        left, top, right, bottom = (
            each * samples for each in (window or (0, 0, width, height)))
        rightward, downward, forward = self.pose[:3, :3].T
        if lens.distortion is None:
            across, down = _normalised(lens, left, top, right, bottom)
            rays: NDArray[np.float64] = (
                across[None, :, None] * rightward + down[:, None, None] * downward + forward)
            return rays
        straight = shown_at_depth_1(lens, (left, top, right, bottom))
        return np.asarray(straight[..., :1] * rightward + straight[..., 1:] * downward + forward)


def shown_at_depth_1(lens: Intrinsics, window: tuple[int, int, int, int] | None = None
                     ) -> NDArray[np.float64]:
    """
    Return x right and y down that the pixels show at depth 1, (height, width, 2).

    It is the inverse of `Intrinsics.pixels_of`. `window` is as for `Camera.ray_directions`.
    """
    left, top, right, bottom = window or (0, 0, lens.width, lens.height)
    is_kept = lens.distortion is not None and (right - left) * (bottom - top) <= _KEPT_PIXELS
    return (_kept_at_depth_1 if is_kept else _at_depth_1)(lens, left, top, right, bottom)


def _normalised(lens: Intrinsics, left: int, top: int, right: int, bottom: int
                ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x of a window's columns of pixels and y of its rows, at depth 1."""
    return (np.asarray((np.arange(left, right) + 0.5 - lens.cx) / lens.fx, np.float64),
            np.asarray((np.arange(top, bottom) + 0.5 - lens.cy) / lens.fy, np.float64))


def _at_depth_1(lens: Intrinsics, left: int, top: int, right: int,
                bottom: int) -> NDArray[np.float64]:
    seen = np.stack(np.meshgrid(*_normalised(lens, left, top, right, bottom)), axis=-1)
    if lens.distortion is None:
        return seen
    return lens.distortion.undistort(seen.reshape(-1, 2)).reshape(seen.shape)


# Photos, and the images of a camera, share a lens: its points take far longer than their rays
_kept_at_depth_1 = lru_cache(maxsize=4)(_at_depth_1)


class OrbitCamera(Camera):
    """
    A camera that keeps the exact azimuth, elevation and distance it was made from.

    Those that are None, as after `dataclasses.replace`, are computed from the pose.
    """

    def __init__(self, pose: NDArray[np.float64], intrinsics: Intrinsics = CANONICAL_INTRINSICS,
                 azimuth: float | None = None, elevation: float | None = None,
                 distance: float | None = None) -> None:
        super().__init__(pose, intrinsics)
        object.__setattr__(self, '_made_from', (
            super().azimuth if azimuth is None else wrap_azimuth(azimuth),
            super().elevation if elevation is None else elevation,
            super().distance if distance is None else distance))

    _made_from: tuple[float, float, float]

    @property
    def azimuth(self) -> float:
        """Radians in [0, 2 pi), counter-clockwise about +z from +x."""
        return self._made_from[0]

    @property
    def elevation(self) -> float:
        """Angle above the horizon, radians in (-pi/2, pi/2)."""
        return self._made_from[1]

    @property
    def distance(self) -> float:
        """Distance from the object frame's origin, metres."""
        return self._made_from[2]


def orbit_camera(
    azimuth: float,
    elevation: float = CANONICAL_ELEVATION,
    distance: float = CANONICAL_DISTANCE,
    intrinsics: Intrinsics = CANONICAL_INTRINSICS,
) -> OrbitCamera:
    """
    Return the upright camera at an azimuth that looks at the origin.

    Angles in radians, distance in metres. Raises ViewError where a number is not finite, the
    distance not above 0, or the elevation not within +-pi/2, where upright is undefined.
    """
    if not all(map(math.isfinite, (azimuth, elevation, distance))) or distance <= 0:
        raise ViewError('invalid camera position: expected finite angles and a distance above 0, '
                        f'got azimuth {azimuth}, elevation {elevation}, distance '
                        f'{distance}', 'pose')
    if abs(elevation) >= math.pi / 2 - 1e-6:
        raise ViewError('invalid elevation: expected one within +-90 degrees, at which upright '
                        f'is undefined, got {math.degrees(elevation):.6g} degrees; move the '
                        'camera aside', 'pose')
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    across, up = math.cos(elevation), math.sin(elevation)
    x, y = across * cosine, across * sine
    pose = np.array([  # in columns: right, down, forward and the position
        [-sine, up * cosine, -x, distance * x],
        [cosine, up * sine, -y, distance * y],
        [0, -x * cosine - y * sine, -up, distance * up],
        [0, 0, 0, 1]])
    return OrbitCamera(pose, intrinsics, azimuth, elevation, distance)


def pose_azimuths(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the azimuths (...) of poses (..., 4, 4), radians in [0, 2 pi)."""
    return np.asarray(wrap_azimuth(np.arctan2(poses[..., 1, 3], poses[..., 0, 3])))
