"""The loop's topics in a bag: views, reconstructions, goals, episodes and counters."""

from collections.abc import Callable, Iterable
from typing import Any

from active_recon.bags.runs.run import Candidates
from active_recon.bags.runs.topics import LoopTopics
from active_recon.bags.storage.bag import Bag, RawMessage
from active_recon.bags.storage.message_types import (
    CLOUD,
    DIAGNOSTICS,
    FLOAT,
    HEADER,
    IMAGE,
    JOINT_STATE,
    POSE,
    read_message,
)
from active_recon.errors import ActiveReconError, DataError
from active_recon.volumes.sparse_grid import SparseVoxelGrid
from msg_tools.cameras import pose_from_msg
from msg_tools.diagnostics import diagnostics_from_msg
from msg_tools.entropy import entropy_from_msg
from msg_tools.episodes import done_from_msg, episode_from_msg
from msg_tools.goals import azimuth_goal_from_msg, scores_from_msg, view_goal_from_msg
from msg_tools.images import image_from_msg, latent_from_msg
from msg_tools.quality import quality_from_msg
from msg_tools.reasons import goal_reason_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray

LOOP = {'episode': HEADER, 'view': POSE, 'occupancy': CLOUD, 'probabilities': CLOUD,
        'latent': IMAGE, 'entropy': JOINT_STATE, 'quality': DIAGNOSTICS, 'next_view': POSE,
        'next_azimuth': JOINT_STATE, 'azimuth_scores': CLOUD, 'goal_reason': DIAGNOSTICS,
        'done': HEADER, 'view_image': IMAGE}
"""The loop's own topics and their types."""
_DIAGNOSTICS = '/diagnostics'


class LoopRecord:
    """
    The content of the loop's topics; all is read at once.

    - parts: the converted messages by topic name in the loop, then by stamp in nanoseconds
    - published, received: their times, by the same keys; a message published again counts once
    - counters: the last ones of `/diagnostics`, by node of the loop: those in its namespace, and
      `nodes`; counted: all of them, with their receive times

    Older recordings have an entropy of all cells without a stamp; it is then computed from the
    `probabilities` of each view. `object_size` is the side of the grid in metres. Raises
    DataError on messages that the loop's nodes do not write.
    """

    def __init__(self, bag: Bag, topics: LoopTopics, object_size: float, object_frame: str,
                 nodes: Iterable[str] = ()) -> None:
        self._namespace = topics.namespace.strip('/')
        self._nodes = {name.strip('/') for name in nodes}
        self.parts: dict[str, dict[int, Any]] = {role: {} for role in LOOP}
        self.published: dict[str, dict[int, int]] = {role: {} for role in LOOP}
        self.received: dict[str, dict[int, int]] = {role: {} for role in LOOP}
        self.counters: dict[str, dict[str, int]] = {}
        self.counted: dict[str, list[tuple[int, dict[str, int]]]] = {}
        self._from_msg: dict[str, Callable[[Any], Any]] = {
            'episode': episode_from_msg,
            'view': lambda msg: pose_from_msg(msg, object_frame),
            'occupancy': lambda msg: SparseVoxelGrid(voxel_grid_from_msg(msg, object_size)),
            'probabilities': lambda msg: SparseVoxelGrid(voxel_grid_from_msg(msg, object_size)),
            'latent': latent_from_msg,
            'view_image': image_from_msg,
            'entropy': entropy_from_msg,
            'quality': quality_from_msg,
            'next_view': lambda msg: view_goal_from_msg(msg, object_frame),
            'next_azimuth': azimuth_goal_from_msg,
            'azimuth_scores': _scores_from_msg,
            'goal_reason': goal_reason_from_msg,
            'done': done_from_msg,
        }
        roles = {topics.full_name(role): role for role in LOOP}
        unstamped = False
        for message in bag.messages({*roles, _DIAGNOSTICS}):
            if message.topic == _DIAGNOSTICS:
                self._count(message)
            elif roles[message.topic] == 'entropy' and message.type_name == FLOAT:
                unstamped = True
            else:
                self._take(roles[message.topic], message)
        if unstamped:
            self._compute_entropies()
        self._refine_empty_grids()

    def _take(self, role: str, message: RawMessage) -> None:
        if message.type_name != LOOP[role]:
            raise DataError(f'{message.topic}: not the type that the loop publishes: expected '
                            f'{LOOP[role]}, got {message.type_name}', 'topics')
        msg = read_message(message)
        stamp = nanoseconds_from_stamp(msg.stamp if LOOP[role] == HEADER else msg.header.stamp)
        if stamp in self.parts[role] and role != 'done':
            return  # only `done` can be withdrawn, under the stamp of the episode
        try:
            self.parts[role][stamp] = self._from_msg[role](msg)
        except ActiveReconError as error:
            raise DataError(f'{message.topic} at {message.received / 1e9:.3f} s: {error}',
                            error.kind) from error
        self.published[role][stamp] = message.published
        self.received[role][stamp] = message.received

    def _refine_empty_grids(self) -> None:
        """Give grids without occupied cells the resolution of the nearest other grid in time."""
        filled, empty = {}, []
        for grids in (self.parts['occupancy'], self.parts['probabilities']):
            for stamp, grid in grids.items():
                if grid.occupancy.any():
                    filled[stamp] = grid
                else:
                    empty.append((grids, stamp))
        for grids, stamp in empty if filled else ():
            nearest = min(filled, key=lambda other: abs(other - stamp))
            grids[stamp] = grids[stamp].as_fine_as(filled[nearest])

    def _compute_entropies(self) -> None:
        for stamp, grid in self.parts['probabilities'].items():
            self.parts['entropy'].setdefault(stamp, grid.entropy())
            for times in (self.published, self.received):
                times['entropy'].setdefault(stamp, times['probabilities'][stamp])

    def _count(self, message: RawMessage) -> None:
        if message.type_name != DIAGNOSTICS:
            return
        for full, status in diagnostics_from_msg(read_message(message)).items():
            name = full.lstrip('/')
            if name in self._nodes or name.rpartition('/')[0] == self._namespace:
                known = self.counters[name] = dict(status.counts)
                self.counted.setdefault(name, []).append((message.received, known))


def _scores_from_msg(msg: Any) -> tuple[Candidates, NDArray[np.float32]]:
    positions, azimuths, scores = scores_from_msg(msg)
    return Candidates(positions.astype(np.float64), azimuths.astype(np.float64)), scores
