"""What is known of the loop, in plain data: filled by whoever hears or reads it, then drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from active_recon.geometry.cameras import Camera
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
from numpy.typing import NDArray

_PICTURE_PIXELS = 160  # as large as a camera in the scene ever is


@dataclass(frozen=True, eq=False)
class TakenView:
    """
    A view that the network took in.

    `stamp` in nanoseconds, `image` (H, W, 3) uint8 RGB or None where it was not heard, `entropy`
    in nats after that view or None.
    """

    stamp: int
    camera: Camera
    image: NDArray[np.uint8] | None = None
    entropy: float | None = None


@dataclass(frozen=True, eq=False)
class Scores:
    """What the planner thinks of each candidate: azimuths (N,) in radians, scores (N,)."""

    azimuths: NDArray[np.floating]
    scores: NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class LoopState:
    """
    The loop at one moment; what is None is not known, or not yet.

    `grid` holds the probabilities after the last view and `threshold` that above which the loop
    itself calls a cell occupied. `network_image` is the last view as the network saw it, (S, S, 3)
    uint8 RGB. `camera` is where the camera is now and `picture` what it sees,
    `goal` where it shall take the next view. `done` is why the episode has ended, '' before.
    """

    episode: str = ''
    views: tuple[TakenView, ...] = ()
    grid: VoxelGrid | None = None
    threshold: float | None = None
    network_image: NDArray[np.uint8] | None = None
    camera: Camera | None = None
    picture: NDArray[np.uint8] | None = None
    goal: Camera | None = None
    scores: Scores | None = None
    done: str = ''


class Observer:
    """
    Keeps `state` up to date with what is seen of a loop, in whatever order it is seen.

    What is stamped before the episode begins belongs to the last one and is left out; stamps are
    nanoseconds. An observer may come late: the episode then has views that it did not see.
    """

    def __init__(self) -> None:
        self.state = LoopState()
        self._begin = 0
        self._goal_stamp = self._scores_stamp = self._done_stamp = self._image_stamp = -1

    def begin_episode(self, identity: str, begin: int) -> None:
        """Begin an episode, unless it is the one that is known; what belongs to it stays."""
        if identity == self.state.episode:
            return
        if begin < self._begin:  # time has gone back, as where a recording is played
            self._goal_stamp = self._scores_stamp = self._done_stamp = self._image_stamp = -1
        known = self.state
        views = tuple(view for view in known.views if view.stamp >= begin >= self._begin)
        self._begin = begin
        self.state = LoopState(
            identity, views, known.grid if views else None, known.threshold if views else None,
            known.network_image if self._image_stamp >= begin else None,
            known.camera, known.picture,
            known.goal if self._goal_stamp >= begin else None,
            known.scores if self._scores_stamp >= begin else None,
            known.done if self._done_stamp >= begin else '')

    def see(self, camera: Camera | None = None, picture: NDArray[np.uint8] | None = None) -> None:
        """Note where the camera is, and what it sees, (H, W, 3) uint8 RGB."""
        self.state = replace(
            self.state, camera=self.state.camera if camera is None else camera,
            picture=self.state.picture if picture is None else picture)

    def take_view(self, view: TakenView, grid: VoxelGrid | None,
                  threshold: float | None) -> None:
        """Add a view and what is known after it."""
        known = self.state.views
        if view.stamp < self._begin or any(view.stamp == old.stamp for old in known):
            return
        views = tuple(sorted((*known, view), key=lambda taken: taken.stamp))
        self.state = replace(self.state, views=views)
        if views[-1] is view:
            self.state = replace(self.state, grid=grid, threshold=threshold)

    def set_network_image(self, stamp: int, image: NDArray[np.uint8]) -> None:
        """Note a view as the network saw it, (S, S, 3) uint8 RGB."""
        if stamp >= self._begin:
            self._image_stamp = stamp
            self.state = replace(self.state, network_image=image)

    def set_goal(self, stamp: int, camera: Camera) -> None:
        """Note a goal; the same stamp again is the same goal."""
        if stamp >= self._begin and stamp > max(self._goal_stamp, self._done_stamp):
            self._goal_stamp = stamp
            self.state = replace(self.state, goal=camera, done='')

    def set_scores(self, stamp: int, scores: Scores) -> None:
        """Note what the planner thinks of the candidates, at its goal's stamp."""
        if stamp >= self._begin:
            self._scores_stamp = stamp
            self.state = replace(self.state, scores=scores)

    def set_done(self, stamp: int, reason: str) -> None:
        """Note the episode's end, at the stamp of the view that decided; '' where it goes on."""
        if stamp >= self._begin:
            self._done_stamp = stamp if reason else -1
            over = reason and stamp > self._goal_stamp
            self.state = replace(
                self.state, done=reason, goal=None if over else self.state.goal)


def own_threshold(occupied: VoxelGrid) -> float | None:
    """
    Return the threshold, to two digits, that the grid's occupied cells were chosen by.

    It is the largest that keeps them all; None where no cell is above 0.
    """
    cells = occupied.occupancy[occupied.occupancy > 0]
    return math.floor(100 * float(cells.min())) / 100 if cells.size else None


def entropy_lines(views: Sequence[TakenView]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the views' numbers, from 1, and entropies in nats (NaN where unknown), (N,) each."""
    entropies = [math.nan if view.entropy is None else view.entropy for view in views]
    return np.arange(1.0, len(views) + 1), np.array(entropies)


def thumbnail(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image, (H, W, 3), no longer or wider than 160 pixels."""
    height, width = image.shape[:2]
    share = _PICTURE_PIXELS / max(height, width)
    if share >= 1:
        return image
    size = max(round(share * width), 1), max(round(share * height), 1)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
