"""Which images of a camera's stream become views: the camera is still, and where it should be."""

from dataclasses import dataclass

from active_recon.cameras import azimuth_difference, Camera
from active_recon.errors import ConfigError
from active_recon.stillness import STILL_TIME, Stillness

TAKE_VIEWS = ('auto', 'at_goal', 'by_separation', 'all')
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
    given or expected, else by_separation. A camera is still when it has rested for `settle_time`
    seconds. All four may be changed in mid-episode.
    """

    def __init__(self, take_views: str = 'auto', goal_tolerance: float = GOAL_TOLERANCE,
                 min_view_separation: float = 0.2, settle_time: float = STILL_TIME) -> None:
        if take_views not in TAKE_VIEWS:
            raise ConfigError(f'take_views: expected one of {", ".join(TAKE_VIEWS)}, '
                              f'got {take_views!r}')
        self.take_views = take_views
        self.goal_tolerance = goal_tolerance
        self.min_view_separation = min_view_separation
        self.settle_time = settle_time
        self.reset()

    def reset(self) -> None:
        """Begin an episode: no goal, no view."""
        self._goal: _Goal | None = None
        self._goal_taken = False
        self._last_azimuth: float | None = None
        self._stillness = Stillness()

    @property
    def open_goal(self) -> float | None:
        """The azimuth of the goal that has no view yet, radians, None where there is none."""
        return None if self._goal is None or self._goal_taken else self._goal.azimuth

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
        self._stillness.add(camera, stamp)
        if self.take_views == 'all':
            return True
        by_goal = self.take_views == 'at_goal' or (
            self.take_views == 'auto' and (goals_expected or self._goal is not None))
        return self._stillness.is_still(self.settle_time) and (
            self._at_new_goal(camera) if by_goal else self._is_separate(camera))

    def took(self, camera: Camera) -> None:
        """Note that the image of this camera became a view."""
        self._goal_taken = True
        self._last_azimuth = camera.azimuth

    def _at_new_goal(self, camera: Camera) -> bool:
        if self.open_goal is None:
            return False
        away = abs(azimuth_difference(camera.azimuth, self.open_goal))
        return bool(away <= self.goal_tolerance)

    def _is_separate(self, camera: Camera) -> bool:
        if self._last_azimuth is None:
            return True
        away = abs(azimuth_difference(camera.azimuth, self._last_azimuth))
        return bool(away >= self.min_view_separation)
