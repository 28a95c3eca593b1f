"""Selects the images of a camera's stream that become views."""

from dataclasses import dataclass

from active_recon.acquisition.stillness import STILL_TIME, Stillness
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.view_distance import view_distance

TAKE_VIEWS = ('auto', 'at_goal', 'by_separation', 'all')
GOAL_TOLERANCE = 0.14
"""Largest distance of a view from its goal, radians: the nearest of 24 can be 7.5 degrees off."""


@dataclass(frozen=True, eq=False)
class _Goal:
    camera: Camera
    stamp: int


class ViewGate:
    """
    Decides for each image whether it becomes a view, from the goal and the last view.

    `take_views` is `at_goal` (once for each goal, the camera at rest and within `goal_tolerance`
    radians of it), `by_separation` (the camera at rest and at least `min_view_separation` radians
    from the last view), `all`, or `auto`: at_goal if there are goals or they are expected, else
    by_separation. A camera is at rest after `settle_time` seconds without motion. All four can be
    changed during an episode. Distances are those of `view_distance`.
    """

    def __init__(self, take_views: str = 'auto', goal_tolerance: float = GOAL_TOLERANCE,
                 min_view_separation: float = 0.2, settle_time: float = STILL_TIME) -> None:
        if take_views not in TAKE_VIEWS:
            raise ConfigError('take_views: unknown value: expected one of '
                              f'{", ".join(TAKE_VIEWS)}, got {take_views!r}')
        self.take_views = take_views
        self.goal_tolerance = goal_tolerance
        self.min_view_separation = min_view_separation
        self.settle_time = settle_time
        self.reset()

    def reset(self) -> None:
        """Begin an episode: no goal, no view."""
        self._goal: _Goal | None = None
        self._goal_taken = False
        self._last: Camera | None = None
        self._stillness = Stillness()

    @property
    def open_goal(self) -> Camera | None:
        """The camera of the goal that awaits a view, None where there is none."""
        ignored = self._goal_taken or self.take_views in ('by_separation', 'all')
        return None if self._goal is None or ignored else self._goal.camera

    def set_goal(self, camera: Camera, stamp: int) -> None:
        """Set the camera of the goal; its stamp in nanoseconds identifies it."""
        if self._goal is None or self._goal.stamp != stamp:
            self._goal = _Goal(camera, stamp)
            self._goal_taken = False

    def wants(self, camera: Camera, stamp: int, goals_expected: bool = False) -> bool:
        """
        Return whether the image of this camera, at this stamp in nanoseconds, is to be a view.

        Call it for every image in order, and `took` for each that becomes a view. With `auto`,
        `goals_expected` states that goals have a publisher.
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
        self._last = camera

    def _at_new_goal(self, camera: Camera) -> bool:
        goal = self.open_goal
        return goal is not None and view_distance(camera, goal) <= self.goal_tolerance

    def _is_separate(self, camera: Camera) -> bool:
        return (self._last is None
                or view_distance(camera, self._last) >= self.min_view_separation)
