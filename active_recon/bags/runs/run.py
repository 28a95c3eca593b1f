"""A recorded run as plain data, for replay and reports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from active_recon.acquisition.goals import Goal
from active_recon.bags.runs.image_gaps import ImageGaps
from active_recon.bags.storage.metadata import QosProfile
from active_recon.geometry.cameras import Camera
from active_recon.policies.reasons import GoalReason
from active_recon.quality.quality import Quality
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray

PHOTOS = 'photos'
"""The reason for the end of an episode that was made of photos with known cameras."""


@dataclass(frozen=True)
class TopicSummary:
    """
    A topic of a bag: its full name, its type as in 'std_msgs/msg/Header', its message count.

    `qos` are the profiles that its publishers offered; empty if unknown.
    """

    name: str
    type_name: str
    count: int
    qos: tuple[QosProfile, ...] = ()


@dataclass(frozen=True, eq=False)
class Candidates:
    """The cameras to choose from: positions (N, 3) in metres, azimuths (N,) in radians."""

    positions: NDArray[np.float64]
    azimuths: NDArray[np.float64]

    @classmethod
    def of(cls, cameras: Sequence[Camera]) -> 'Candidates':
        """Return the candidates of cameras."""
        return cls(np.array([camera.position for camera in cameras]).reshape(-1, 3),
                   np.array([camera.azimuth for camera in cameras]))


@dataclass(frozen=True, eq=False)
class RecordedGoal:
    """
    A goal of the planner and the scores of its candidates.

    - camera: in the object frame, without a lens; its azimuth is exact if `next_azimuth` was
      recorded; stamp: the goal's identity, nanoseconds
    - candidates, N of them, and scores (N,): None if they were not recorded
    - received: when the recorder received the goal, nanoseconds
    - replacements: the goals that followed, as this one and then those were given up
    - reason: why it is worth its view; None: not told
    """

    camera: Camera
    stamp: int
    candidates: Candidates | None
    scores: NDArray[np.float32] | None
    received: int
    replacements: Sequence['RecordedGoal'] = ()
    reason: GoalReason | None = None

    @classmethod
    def of(cls, goal: Goal, stamp: int, received: int | None = None,
           reason: GoalReason | None = None) -> 'RecordedGoal':
        """Return a goal as recorded; by default it is received at its stamp."""
        return cls(goal.camera, stamp, Candidates.of(goal.candidates), goal.scores,
                   stamp if received is None else received, reason=reason)

    @property
    def final(self) -> 'RecordedGoal':
        """The goal that was not given up."""
        return (self, *self.replacements)[-1]


@dataclass(frozen=True, eq=False)
class RecordedView:
    """
    A view and what the loop published after it; None: not recorded.

    - stamp: of the image, nanoseconds; image: (H, W, 3) uint8 RGB; camera: in the object frame
    - reconstruction: the probabilities, 0 below the floor of what is published
    - occupied: the cells above the threshold
    - latent: A_t, (C, h, w); entropy: nats; quality: as it was judged
    - goal: decided after this view; None also if the episode was done
    - done: the reason if the episode was done after this view, else ''; a goal may follow if
      `plan` was called then
    - depth: of the depth camera beside the camera, where the loop took it in; depth_refusal: why
      the network did not, in one line, where a replay tried
    - received: receive times of the view's messages, nanoseconds, by topic name in the loop:
      'camera/image_raw', 'view', 'occupancy', 'probabilities', 'entropy', ...
    - reduced: returns a smaller image and its camera; None where the image was worked on
    """

    stamp: int
    image: NDArray[np.uint8]
    camera: Camera
    reconstruction: VoxelGrid | None
    occupied: VoxelGrid | None
    latent: NDArray[np.float32] | None
    entropy: float | None
    goal: RecordedGoal | None
    received: Mapping[str, int]
    done: str = ''
    quality: Quality | None = None
    depth: DepthImage | None = None
    depth_refusal: str = ''
    reduced: Callable[[int], tuple[NDArray[np.uint8], Camera]] | None = None

    def for_network(self, reduction: int) -> tuple[NDArray[np.uint8], Camera]:
        """Return the image and its camera as the loop decoded it, reduced by that much."""
        return (self.image, self.camera) if self.reduced is None else self.reduced(reduction)


@dataclass(frozen=True, eq=False)
class RecordedEpisode:
    """
    One object's views; `begin` in nanoseconds, `done` the reason for the end, '' if none.

    `begun_before`: the episode had views before the recording, which lacks their images, or goes
    on from a saved state.
    """

    id: str
    begin: int
    first_goal: RecordedGoal | None
    views: Sequence[RecordedView]
    done: str
    begun_before: bool = False

    def done_after(self, view: RecordedView) -> str:
        """Return the reason if the episode ended after that view, else ''."""
        ends = not view.done and view is self._last and view.goal is None
        return self.done if ends else view.done

    def given_up(self, view: RecordedView | None) -> list[Camera]:
        """Return the cameras of the goals given up after a view; None: before the first view."""
        goal = view.goal if view else self.first_goal
        if goal is None:
            return []
        asked = [goal.camera, *(later.camera for later in goal.replacements)]
        none_left = view is self._last and self.done == 'no_reachable_azimuth'
        return asked if none_left else asked[:-1]

    @property
    def _last(self) -> RecordedView | None:
        return max(self.views, key=lambda view: view.stamp, default=None)


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """
    All episodes of a bag and its metadata.

    - provenance: versions, hashes, policy, seed and object; empty in bags of other recorders
    - parameters: by node; counters: the last of `/diagnostics`, by node
    - begin, end: receive times of the first and the last message, nanoseconds
    - gaps: missing images
    - assumed: in words, what neither the bag nor the options state
    """

    path: Path
    episodes: Sequence[RecordedEpisode]
    provenance: Mapping[str, str]
    parameters: Mapping[str, Mapping[str, Any]]
    counters: Mapping[str, Mapping[str, int]]
    topics: Sequence[TopicSummary]
    begin: int
    end: int
    gaps: ImageGaps = ImageGaps()
    assumed: Sequence[str] = ()
