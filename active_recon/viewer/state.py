"""The state of the loop as plain data, from a running loop or a bag, for display."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from active_recon.geometry.cameras import Camera
from active_recon.policies.reasons import GoalReason
from active_recon.quality.quality import Quality
from active_recon.viewer.view_result import Surface, ViewResult
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray

_PICTURE_PIXELS = 160  # the largest size of a picture in the scene


@dataclass(frozen=True, eq=False)
class Scores:
    """The planner's candidates: positions (N, 3) in metres, scores (N,)."""

    positions: NDArray[np.floating]
    scores: NDArray[np.floating]

    def finite(self) -> 'Scores':
        """Return those of candidates whose score and position are finite."""
        known = np.isfinite(self.scores) & np.isfinite(self.positions).all(axis=1)
        return Scores(self.positions[known], self.scores[known])


@dataclass(frozen=True, eq=False)
class LoopState:
    """
    The state of the loop at one moment; a value is None while it is not known.

    - grid: the probabilities after the last view; threshold: the loop's own, above which a cell
      is occupied
    - network_image: the last view as the network received it, (S, S, 3) uint8 RGB
    - camera: where the camera is now; picture: its last image, (H, W, 3) uint8 RGB
    - goal: the camera of the next view; goal_reason: why it is worth taking
    - done: the reason why the episode ended, '' before
    - surface: the last one in colours
    - missed: how many views of the episode there were before the first of `views`
    """

    episode: str = ''
    views: tuple[ViewResult, ...] = ()
    grid: VoxelGrid | None = None
    threshold: float | None = None
    network_image: NDArray[np.uint8] | None = None
    camera: Camera | None = None
    picture: NDArray[np.uint8] | None = None
    goal: Camera | None = None
    scores: Scores | None = None
    done: str = ''
    goal_reason: GoalReason | None = None
    surface: Surface | None = None
    missed: int = 0


class Observer:
    """
    Keeps `state` up to date with the messages of a loop, in whatever order they arrive.

    Messages stamped before the episode began belong to the previous one and are dropped; stamps
    are nanoseconds. An observer that starts late misses the episode's earlier views, and knows
    how many they were.
    """

    def __init__(self) -> None:
        self.state = LoopState()
        self._begin = 0
        self._goal_stamp = self._scores_stamp = self._done_stamp = self._image_stamp = -1
        self._surface_stamp = -1
        self._count = -1, 0
        self._quality: tuple[int, Quality | None] = -1, None
        self._reason: tuple[int, GoalReason | None] = -1, None

    def begin_episode(self, identity: str, begin: int) -> None:
        """Begin an episode, unless it is the current one; keep what already belongs to it."""
        if identity == self.state.episode:
            return
        if begin < self._begin:  # the clock jumped back, as when a recording is played
            self._goal_stamp = self._scores_stamp = self._done_stamp = self._image_stamp = -1
            self._surface_stamp = -1
        known = self.state
        views = tuple(view for view in known.views if view.stamp >= begin >= self._begin)
        self._begin = begin
        self.state = LoopState(
            identity, views, known.grid if views else None, known.threshold if views else None,
            known.network_image if self._image_stamp >= begin else None,
            known.camera, known.picture,
            known.goal if self._goal_stamp >= begin else None,
            known.scores if self._scores_stamp >= begin else None,
            known.done if self._done_stamp >= begin else '',
            known.goal_reason if self._goal_stamp >= begin else None,
            known.surface if self._surface_stamp >= begin else None, self._missed(views))

    def set_camera(self, camera: Camera | None = None,
                   picture: NDArray[np.uint8] | None = None) -> None:
        """Set where the camera is, or its last image, (H, W, 3) uint8 RGB."""
        self.state = replace(
            self.state, camera=self.state.camera if camera is None else camera,
            picture=self.state.picture if picture is None else picture)

    def set_surface(self, stamp: int, surface: Surface | None) -> None:
        """Set the surface after the view with a stamp in nanoseconds; None: there is none."""
        if stamp >= self._begin:
            self._surface_stamp = stamp
            self.state = replace(self.state, surface=surface)

    def add_view(self, view: ViewResult, grid: VoxelGrid | None,
                 occupied: VoxelGrid | None) -> None:
        """Add a view with the probabilities and the occupied cells after it."""
        known = self.state.views
        if view.stamp < self._begin or any(view.stamp == old.stamp for old in known):
            return
        if view.stamp == self._quality[0]:
            view = replace(view, quality=self._quality[1])
        views = tuple(sorted((*known, view), key=lambda each: each.stamp))
        self.state = replace(
            self.state, views=views, missed=self._missed(views, self.state.missed))
        if views[-1] is view:
            threshold = None if occupied is None else own_threshold(occupied)
            self.state = replace(self.state, grid=grid, threshold=threshold)

    def set_count(self, stamp: int, count: int) -> None:
        """Set how many views there are with that of a stamp, which may not be known yet."""
        self._count = stamp, count
        self.state = replace(
            self.state, missed=self._missed(self.state.views, self.state.missed))

    def _missed(self, views: tuple[ViewResult, ...], before: int = 0) -> int:
        """Return how many came before the first of some views; `before`: as was known so far."""
        stamp, count = self._count
        return next((max(count - number, 0) for number, view in enumerate(views, 1)
                     if view.stamp == stamp), before)

    def set_quality(self, stamp: int, quality: Quality) -> None:
        """Set the quality after the view of a stamp, which may not be known yet."""
        self._quality = stamp, quality
        self.state = replace(self.state, views=tuple(
            replace(view, quality=quality) if view.stamp == stamp else view
            for view in self.state.views))

    def set_network_image(self, stamp: int, image: NDArray[np.uint8]) -> None:
        """
        Set the last view as the network received it, (S, S, 3) uint8 RGB.

        A view whose own image was missed, as on a busy machine, has it instead.
        """
        if stamp >= self._begin:
            self._image_stamp = stamp
            self.state = replace(self.state, network_image=image, views=tuple(
                replace(view, image=image) if view.stamp == stamp and view.image is None else view
                for view in self.state.views))

    def set_goal(self, stamp: int, camera: Camera) -> None:
        """Set the goal; the same stamp again is the same goal."""
        if stamp >= self._begin and stamp > max(self._goal_stamp, self._done_stamp):
            self._goal_stamp = stamp
            reason = self._reason[1] if self._reason[0] == stamp else None
            self.state = replace(self.state, goal=camera, done='', goal_reason=reason)

    def set_goal_reason(self, stamp: int, reason: GoalReason) -> None:
        """Set why the goal of a stamp, which may not be known yet, is worth its view."""
        self._reason = stamp, reason
        if stamp == self._goal_stamp and self.state.goal is not None:
            self.state = replace(self.state, goal_reason=reason)

    def set_scores(self, stamp: int, scores: Scores) -> None:
        """Set the scores of the candidates, at their goal's stamp."""
        if stamp >= self._begin:
            self._scores_stamp = stamp
            self.state = replace(self.state, scores=scores)

    def set_done(self, stamp: int, reason: str) -> None:
        """Set why the episode ended, at the stamp of its last view; '' while it goes on."""
        if stamp >= self._begin:
            self._done_stamp = stamp if reason else -1
            over = reason and stamp > self._goal_stamp
            self.state = replace(
                self.state, done=reason, goal=None if over else self.state.goal,
                goal_reason=None if over else self.state.goal_reason)


def own_threshold(occupied: VoxelGrid) -> float | None:
    """
    Return the threshold of a grid that holds only occupied cells, rounded down to two digits.

    It is the largest that keeps all of them, below 1 also where all are certain; None where no
    cell is above 0.
    """
    cells = occupied.occupancy[occupied.occupancy > 0]
    if not cells.size:
        return None
    least = np.nextafter(cells.min(), np.float32(0))  # cells at a threshold are not above it
    return math.floor(100 * float(least)) / 100


def entropy_lines(views: Sequence[ViewResult], missed: int = 0
                  ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Return the views' numbers and entropies in nats (NaN where unknown), (N,) each.

    The numbers are from 1, after those `missed`.
    """
    entropies = [math.nan if view.entropy is None else view.entropy for view in views]
    return np.arange(1.0, len(views) + 1) + missed, np.array(entropies)


def thumbnail(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image, (H, W, 3), reduced to at most 160 pixels in width and height."""
    height, width = image.shape[:2]
    share = _PICTURE_PIXELS / max(height, width)
    if share >= 1:
        return image
    size = max(round(share * width), 1), max(round(share * height), 1)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
