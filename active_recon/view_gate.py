"""Which images of a camera's stream become views: the camera is still, and where it should be."""

from dataclasses import dataclass

from active_recon.cameras import azimuth_difference, Camera
from active_recon.errors import ConfigError
import numpy as np

TAKE_VIEWS = ('auto', 'at_goal', 'by_separation', 'all')
STILL_ANGLE = 0.01
"""A still camera has not moved by more, radians as seen from the object or turned in place."""
STILL_TIME = 0.08
"""For so long, seconds: two images of a stream of 10 Hz."""
GOAL_TOLERANCE = 0.14
"""An azimuth this near to a goal reaches it, radians: 24 rendered views can be 7.5 degrees off."""


@dataclass(frozen=True)
class _Goal:
    azimuth: float
    stamp: int


class ViewGate:
    """
    Decides image by image; it knows the current goal and the view taken last.

    `take_views` is `at_goal` (once for each goal, the camera still and its azimuth within
    `goal_tolerance` radians), `by_separation` (the camera still and its azimuth at least
    `min_view_separation` radians from the last view), `all`, or `auto`: at_goal where goals are
    given or expected, else by_separation.
    """

    def __init__(self, take_views: str = 'auto', goal_tolerance: float = GOAL_TOLERANCE,
                 min_view_separation: float = 0.2) -> None:
        if take_views not in TAKE_VIEWS:
            raise ConfigError(f'take_views: expected one of {", ".join(TAKE_VIEWS)}, '
                              f'got {take_views!r}')
        self._take_views = take_views
        self._goal_tolerance = goal_tolerance
        self._min_view_separation = min_view_separation
        self.reset()

    def reset(self) -> None:
        """Begin an episode: no goal, no view."""
        self._goal: _Goal | None = None
        self._goal_taken = False
        self._last_azimuth: float | None = None
        self._rest: tuple[int, Camera] | None = None

    def set_goal(self, azimuth: float, stamp: int) -> None:
        """Ask for a view at an azimuth; the stamp (nanoseconds) tells goals apart."""
        if self._goal is None or self._goal.stamp != stamp:
            self._goal = _Goal(azimuth, stamp)
            self._goal_taken = False

    def wants(self, camera: Camera, stamp: int, goals_expected: bool = False) -> bool:
        """
        Return whether the image of this camera, at this stamp in nanoseconds, is to be a view.

        It is to be told of every image, and of each that became a view by `took`.
        `goals_expected` tells `auto` that someone is there who gives goals.
        """
        still = self._is_still(camera, stamp)
        if self._take_views == 'all':
            return True
        by_goal = self._take_views == 'at_goal' or (
            self._take_views == 'auto' and (goals_expected or self._goal is not None))
        return still and (self._at_new_goal(camera) if by_goal else self._is_separate(camera))

    def took(self, camera: Camera) -> None:
        """Note that the image of this camera became a view."""
        self._goal_taken = True
        self._last_azimuth = camera.azimuth

    def _at_new_goal(self, camera: Camera) -> bool:
        if self._goal is None or self._goal_taken:
            return False
        away = abs(azimuth_difference(camera.azimuth, self._goal.azimuth))
        return bool(away <= self._goal_tolerance)

    def _is_separate(self, camera: Camera) -> bool:
        if self._last_azimuth is None:
            return True
        away = abs(azimuth_difference(camera.azimuth, self._last_azimuth))
        return bool(away >= self._min_view_separation)

    def _is_still(self, camera: Camera, stamp: int) -> bool:
        """Return whether the camera has stayed near one pose for STILL_TIME."""
        if self._rest is None or _moved(self._rest[1], camera) > STILL_ANGLE:
            self._rest = stamp, camera
        return stamp - self._rest[0] >= STILL_TIME * 1e9


def _moved(a: Camera, b: Camera) -> float:
    """Return the larger of the angle moved, as seen from the object, and the angle turned."""
    shift = float(np.linalg.norm(a.position - b.position)) / a.distance
    cosine = (np.trace(a.pose[:3, :3].T @ b.pose[:3, :3]) - 1) / 2
    return max(shift, float(np.arccos(np.clip(cosine, -1, 1))))
