"""The goals that a camera is sent to: a ring of candidates around the object, and the best one."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.acquisition.motion import MotionLimits, utility
from active_recon.geometry.cameras import azimuth_difference, Camera, orbit_camera, OrbitCamera
from active_recon.geometry.view_distance import nearest_camera
import numpy as np
from numpy.typing import NDArray

_STEEPEST = math.radians(89)  # of goals at the camera's own elevation: above, nothing is upright


@dataclass(frozen=True, eq=False)
class Goal:
    """
    The camera of the next view, and the utility of every reachable candidate.

    - camera: its pose in the object frame; it may lie between the candidates
    - candidates: N cameras; scores: (N,), more is better
    """

    camera: Camera
    candidates: Sequence[Camera]
    scores: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Wanted:
    """A camera between the candidates, if one is wanted, and the candidates' scores (N,)."""

    camera: Camera | None
    scores: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Ring:
    """
    Where goals stand: upright, looking at the object's centre.

    - azimuths: (N,) of the candidates, radians in the object frame
    - elevation: radians; None: that of the camera's last view, up to 89 degrees
    - distance: metres
    """

    azimuths: NDArray[np.float64]
    elevation: float | None
    distance: float

    def candidates(self, camera: Camera) -> list[OrbitCamera]:
        """Return the N candidates while that is the camera of the last view."""
        return [self.goal(float(azimuth), camera) for azimuth in self.azimuths]

    def goal(self, azimuth: float, camera: Camera) -> OrbitCamera:
        """Return the goal at an azimuth while that is the camera of the last view."""
        return orbit_camera(azimuth, self.elevation_for(camera), self.distance)

    def elevation_for(self, camera: Camera) -> float:
        """Return the elevation of goals while that is the camera of the last view."""
        if self.elevation is not None:
            return self.elevation
        return min(max(camera.elevation, -_STEEPEST), _STEEPEST)


def best_goal(wanted: Wanted, candidates: Sequence[Camera], camera: Camera,
              taken: Sequence[Camera], failed: Sequence[Camera], limits: MotionLimits,
              motion_weight: float) -> Goal | None:
    """
    Return the best goal for a camera that is somewhere; None where none is left.

    What is wanted between the candidates is worth as much as the best of them. The views `taken`
    are asked for again only where no other is left, those that `failed` never; `motion_weight` is
    as in `utility`.
    """
    scores, options = wanted.scores, list(candidates)
    nearest = np.arange(len(candidates))
    if wanted.camera is not None:  # first: of those alike, the first is taken
        options.insert(0, wanted.camera)
        nearest = np.insert(nearest, 0, nearest_camera(wanted.camera, candidates))
        scores = np.append(scores.max(), scores)
    azimuths = np.array([option.azimuth for option in options])
    is_failed, is_taken = (
        np.isin(nearest, [nearest_camera(each, candidates) for each in cameras])
        for cameras in (failed, taken))
    is_open = limits.allows(azimuths) & ~is_failed
    if not is_open.any():
        return None
    fresh = is_open & ~is_taken
    travel = np.abs(azimuth_difference(azimuths, camera.azimuth))
    value = utility(scores, travel, motion_weight)
    best = int(np.where(fresh if fresh.any() else is_open, value, -np.inf).argmax())
    own = slice(len(options) - len(candidates), None)
    return Goal(options[best], [each for each, free in zip(
        candidates, is_open[own], strict=True) if free], value[own][is_open[own]])
