"""Where goals stand: on a ring around the object, on a dome, or at the places of a list."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
import math
from typing import Protocol

from active_recon.acquisition.motion import END_TOLERANCE, MotionLimits
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import (
    AZIMUTHS,
    Camera,
    CANONICAL_DISTANCE,
    orbit_camera,
    OrbitCamera,
    TURN,
    VIEW_COUNT,
    wrap_azimuth,
)
from active_recon.geometry.view_distance import view_distances
import numpy as np
from numpy.typing import NDArray

_MOST_TURNS = 2 * TURN  # of an azimuth of a list: more are degrees
STEEPEST = 1.5
"""Largest elevation of a goal that a parameter can name, radians: beyond, nothing is upright."""
RING_DISTANCE = math.radians(20)
"""About how far the rings of a dome are apart."""
_STEEPEST_OWN = math.radians(89)  # of goals at the camera's own elevation


class GoalPlaces(Protocol):
    """Where goals stand: upright, looking at the object's centre."""

    def candidates(self, camera: Camera) -> list[OrbitCamera]:
        """Return the candidates while that is the camera of the last view."""
        ...

    def goal(self, azimuth: float, camera: Camera) -> OrbitCamera | None:
        """
        Return a goal at an azimuth, radians, while that is the camera of the last view.

        None where goals stand at the candidates alone.
        """
        ...


@dataclass(frozen=True)
class Ring:
    """
    A ring around the object.

    - azimuths: of the candidates, radians in the object frame
    - elevation: radians; None: that of the camera's last view, up to 89 degrees
    - distance: metres
    """

    azimuths: tuple[float, ...]
    elevation: float | None
    distance: float

    def candidates(self, camera: Camera) -> list[OrbitCamera]:
        """Return the ring's candidates; see GoalPlaces."""
        return list(_ring(self.azimuths, self._height(camera), self.distance))

    def goal(self, azimuth: float, camera: Camera) -> OrbitCamera:
        """Return the goal of the ring at an azimuth; see GoalPlaces."""
        return orbit_camera(azimuth, self._height(camera), self.distance)

    def _height(self, camera: Camera) -> float:
        """Return the elevation of the goals after a camera's view."""
        if self.elevation is not None:
            return self.elevation
        return min(max(camera.elevation, -_STEEPEST_OWN), _STEEPEST_OWN)


@lru_cache(maxsize=4)
def _ring(azimuths: tuple[float, ...], elevation: float,
          distance: float) -> tuple[OrbitCamera, ...]:
    """Return the cameras of a ring, which a turntable asks for after every view."""
    return tuple(orbit_camera(azimuth, elevation, distance) for azimuth in azimuths)


@dataclass(frozen=True)
class Dome:
    """
    Rings above each other, (azimuths, elevation) each from the lowest to the highest, radians.

    A goal between the candidates keeps the camera's elevation, within the dome's.
    """

    rings: tuple[tuple[tuple[float, ...], float], ...]
    distance: float

    @cached_property
    def _cameras(self) -> list[OrbitCamera]:
        return [orbit_camera(azimuth, elevation, self.distance)
                for azimuths, elevation in self.rings for azimuth in azimuths]

    def candidates(self, camera: Camera) -> list[OrbitCamera]:
        """Return the candidates, ring by ring from below; see GoalPlaces."""
        return self._cameras

    def goal(self, azimuth: float, camera: Camera) -> OrbitCamera:
        """Return the goal at the camera's elevation, or as near as can be; see GoalPlaces."""
        elevation = min(max(camera.elevation, self.rings[0][1]), self.rings[-1][1])
        return orbit_camera(azimuth, elevation, self.distance)


@dataclass(frozen=True)
class Listed:
    """Places of a list and no others: azimuth, elevation (radians) and distance (metres) each."""

    places: tuple[tuple[float, float, float], ...]

    @cached_property
    def _cameras(self) -> list[OrbitCamera]:
        return [orbit_camera(*place) for place in self.places]

    def candidates(self, camera: Camera) -> list[OrbitCamera]:
        """Return the places in their order; see GoalPlaces."""
        return self._cameras

    def goal(self, azimuth: float, camera: Camera) -> None:
        """Return none: only the places themselves can be reached; see GoalPlaces."""


def goal_places(limits: MotionLimits, yaw: float = 0.0, elevation: float | None = None,
                distance: float = CANONICAL_DISTANCE, elevation_range: Sequence[float] = (),
                reachable_views: Sequence[float] = ()) -> GoalPlaces:
    """
    Return where goals stand.

    - limits: of the azimuths, of which more are candidates than can be reached; `yaw`: where the
      azimuths of rings and domes begin, radians
    - elevation: of a ring, radians; None: that of the camera's last view; distance: metres
    - elevation_range: low and high, radians, of a dome; empty for a ring. Its rings are about 20
      degrees apart, the lowest and the highest at the ends of the range. At the elevation e a ring
      has 24 cos(e) azimuths, rounded, at least one: they are about 15 degrees apart as seen from
      the object
    - reachable_views: azimuth, elevation, distance, azimuth, ... of a list; 0 for `distance`

    Raises ConfigError on invalid values, and where they contradict each other.
    """
    if elevation_range and reachable_views:
        raise ConfigError('elevation_range, reachable_views: both given: expected one of them')
    if not 0 < distance < math.inf:
        raise ConfigError(f'distance: out of range: expected metres above 0, got {distance}')
    if elevation is not None and not abs(elevation) <= STEEPEST:
        raise ConfigError(f'elevation: out of range: expected -{STEEPEST} to {STEEPEST} rad, got '
                          f'{elevation}')
    if elevation is not None and (elevation_range or reachable_views):
        other = 'elevation_range' if elevation_range else 'reachable_views'
        raise ConfigError(f'elevation, {other}: both given: expected one of them')
    if reachable_views:
        return _listed(limits, distance, reachable_views)
    if elevation_range:
        return _dome(limits, yaw, distance, elevation_range)
    return Ring(_azimuths(limits, AZIMUTHS, yaw), elevation, distance)


def _azimuths(limits: MotionLimits, grid: NDArray[np.float64], yaw: float) -> tuple[float, ...]:
    return tuple(limits.candidates((grid + yaw) % TURN).tolist())


def _dome(limits: MotionLimits, yaw: float, distance: float,
          elevation_range: Sequence[float]) -> Dome:
    if len(elevation_range) != 2 or not (
            -STEEPEST <= elevation_range[0] < elevation_range[1] <= STEEPEST):
        raise ConfigError(f'elevation_range: not a range: expected low and high from -{STEEPEST} '
                          f'to {STEEPEST} rad, low below high, got {list(elevation_range)}')
    low, high = elevation_range
    count = max(round((high - low) / RING_DISTANCE), 1) + 1
    rings = []
    for elevation in np.linspace(low, high, count).tolist():
        around = max(round(VIEW_COUNT * math.cos(elevation)), 1)
        rings.append((_azimuths(limits, np.arange(around) * TURN / around, yaw), elevation))
    return Dome(tuple(rings), distance)


def _listed(limits: MotionLimits, distance: float, views: Sequence[float]) -> Listed:
    if limits.reachable_azimuths:
        raise ConfigError(
            'reachable_azimuths, reachable_views: both given: expected one of them')
    if len(views) % 3 or not np.isfinite(views).all():
        raise ConfigError('reachable_views: not views: expected azimuth, elevation (rad) and '
                          f'distance (m; 0 for `distance`) of each, got {list(views)}')
    if any(abs(azimuth) > _MOST_TURNS for azimuth in views[::3]):
        raise ConfigError('reachable_views: out of range: expected azimuths of at most two turns, '
                          f'rad, got {max(views[::3], key=abs):g}; is it in degrees?')
    places = tuple((wrap_azimuth(azimuth), float(elevation), float(away or distance))
                   for azimuth, elevation, away in zip(*(views[at::3] for at in range(3)),
                                                       strict=True))
    for _, elevation, away in places:
        if abs(elevation) > STEEPEST or away <= 0:
            raise ConfigError('reachable_views: out of range: expected elevations from '
                              f'-{STEEPEST} to {STEEPEST} rad and distances of 0 m or more, got '
                              f'{elevation:g} and {away:g}')
    cameras = [orbit_camera(*place) for place in places]
    again = np.tril(view_distances(cameras, cameras) <= END_TOLERANCE, -1).any(axis=1)
    if again.any():
        camera = cameras[int(again.argmax())]
        raise ConfigError('reachable_views: two in one direction: expected each direction once, '
                          f'got azimuth {camera.azimuth:g}, elevation {camera.elevation:g} again')
    if not limits.allows([place[0] for place in places]).any():
        raise ConfigError('azimuth_range, forbidden_sectors, reachable_views: no view left: '
                          'expected one where the camera can go, but together they leave none')
    return Listed(places)
