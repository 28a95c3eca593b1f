"""A recorded run, as plain numbers: what a bag is read into, replayed from and reported on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from active_recon.bags.runs.image_gaps import ImageGaps
from active_recon.bags.storage.metadata import QosProfile
from active_recon.geometry.cameras import Camera
from active_recon.planner import Goal
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TopicSummary:
    """
    A topic of a bag: its full name, its type as in 'std_msgs/msg/Header', its messages.

    `qos` are the profiles that its publishers offered, as far as the bag tells.
    """

    name: str
    type_name: str
    count: int
    qos: tuple[QosProfile, ...] = ()


@dataclass(frozen=True, eq=False)
class Candidates:
    """Cameras that the planner chose among: positions (N, 3) in metres, azimuths (N,) radians."""

    positions: NDArray[np.float64]
    azimuths: NDArray[np.float64]

    @classmethod
    def of(cls, cameras: Sequence[Camera]) -> 'Candidates':
        """Return those of a goal."""
        return cls(np.array([camera.position for camera in cameras]).reshape(-1, 3),
                   np.array([camera.azimuth for camera in cameras]))


@dataclass(frozen=True, eq=False)
class RecordedGoal:
    """
    Where the planner wanted to look from, and what it thought of every candidate.

    - camera: in the object frame, with the lens of none; its azimuth has all of its bits where
      `next_azimuth` was recorded; stamp: the goal's identity, nanoseconds
    - candidates, N of them, and scores (N,): None where they were not recorded
    - received: when the recorder received the goal, nanoseconds
    - instead: the goals that followed as this one was given up, and then those, until a view came
    """

    camera: Camera
    stamp: int
    candidates: Candidates | None
    scores: NDArray[np.float32] | None
    received: int
    instead: Sequence['RecordedGoal'] = ()

    @classmethod
    def of(cls, goal: Goal, stamp: int, received: int | None = None) -> 'RecordedGoal':
        """Return what is recorded of a goal; by default it is received as it is stamped."""
        return cls(goal.camera, stamp, Candidates.of(goal.candidates), goal.scores,
                   stamp if received is None else received)

    @property
    def followed(self) -> 'RecordedGoal':
        """The goal that was not given up."""
        return (self, *self.instead)[-1]


@dataclass(frozen=True, eq=False)
class RecordedView:
    """
    A view that the network took in, and what was known after it; None: not recorded.

    - stamp: of the image, nanoseconds; image: (H, W, 3) uint8 RGB; camera: in the object frame
    - reconstruction: the probabilities, 0 where they were below the floor that is published
    - occupied: the cells above the threshold
    - latent: A_t, (C, h, w); entropy: nats
    - goal: decided after this view; None too where the episode was done
    - done: the reason where the episode was done after this view, '' where it was not; with a goal
      too where `plan` then asked for one more
    - received: when each message of the view was received, nanoseconds, by the topic's name in
      the loop: 'camera/image_raw', 'view', 'occupancy', 'probabilities', 'entropy', ...
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


@dataclass(frozen=True, eq=False)
class RecordedEpisode:
    """
    One object's views; `begin` in nanoseconds, `done` the reason for the end, '' if none.

    `begun_before`: there were views before the recording, whose images it does not have.
    """

    id: str
    begin: int
    first_goal: RecordedGoal | None
    views: Sequence[RecordedView]
    done: str
    begun_before: bool = False

    def done_after(self, view: RecordedView) -> str:
        """Return the reason where it was that view that ended the episode, else ''."""
        ends = not view.done and view is self._last and view.goal is None
        return self.done if ends else view.done

    def given_up(self, view: RecordedView | None) -> list[Camera]:
        """Return the cameras of the goals given up after a view, None: before the first one."""
        goal = view.goal if view else self.first_goal
        if goal is None:
            return []
        asked = [goal.camera, *(later.camera for later in goal.instead)]
        none_left = view is self._last and self.done == 'no_reachable_azimuth'
        return asked if none_left else asked[:-1]

    @property
    def _last(self) -> RecordedView | None:
        return max(self.views, key=lambda view: view.stamp, default=None)


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """
    All episodes of a bag, and what it says of itself.

    - provenance: the bag's own record of versions, hashes, policy, seed and object; others' bags
      have none
    - parameters: by node; counters: the last of `/diagnostics`, by node
    - begin, end: receive times of the first and the last message, nanoseconds
    - gaps: what of the camera's images is missing
    - assumed: in words, what neither the bag nor its reader was told
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
