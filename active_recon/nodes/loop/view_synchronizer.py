"""What the reconstructor says of its views, joined on their stamp: all that a planner needs."""

from collections.abc import Callable
from dataclasses import dataclass
import time
from typing import Any

from active_recon.geometry.cameras import Camera
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.qos import LATCHED
from active_recon.volumes.voxels import VoxelGrid
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.entropy import entropy_from_msg
from msg_tools.images import latent_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image, JointState, PointCloud2

FIND_VIEWS_S = 0.5
"""What is latched comes so soon after its publishers were found."""


@dataclass(frozen=True, eq=False)
class HeardView:
    """
    A view: its stamp in nanoseconds, A_t (C, h, w), the camera, the entropy.

    With the probabilities where they are heard for the policy.
    """

    stamp: int
    latent: NDArray[np.float32]
    camera: Camera
    entropy: float
    volume: VoxelGrid | None = None


class HeardViews:
    """
    Hears `latent`, `view` and `entropy`, in any order, while the node is active.

    Each view that is whole is handed to `take`, but for what is stamped before the episode. The
    last one is kept in `last`: it may be heard before the episode is that it belongs to.
    """

    def __init__(self, node: ManagedNode, frame: str, diagnostics: Diagnostics,
                 take: Callable[[HeardView], None]) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._take = take
        self._parts = ['latent', 'camera', 'entropy']
        self._joiner = StampJoiner(self._parts)
        self._begin = 0
        self._matched_at: float | None = None
        self.last: HeardView | None = None
        self._heard = [node.create_subscription(kind, topic, self._on(name, read), LATCHED)
                       for kind, topic, name, read in (
            (Image, 'latent', 'latent', latent_from_msg),
            (PoseStamped, 'view', 'camera', lambda msg: Camera(pose_from_msg(msg, frame))),
            (JointState, 'entropy', 'entropy', entropy_from_msg))]

    def hear_volume(self, object_size: float) -> None:
        """Join the probabilities too, of a cube of so many metres, for the policy."""
        if 'volume' in self._parts:
            return
        self._parts.append('volume')
        self._joiner = StampJoiner(self._parts)
        self._heard.append(self._node.create_subscription(
            PointCloud2, 'probabilities',
            self._on('volume', lambda msg: voxel_grid_from_msg(msg, object_size)), LATCHED))

    def begin(self, stamp: int) -> None:
        """Leave out what is stamped before an episode's begin, nanoseconds."""
        if stamp < self._begin:  # time went back: what is stamped later is of before
            self.forget()
        self._begin = stamp
        self._joiner.forget_before(stamp)
        if self.last is not None and self.last.stamp < stamp:
            self.last = None

    def forget(self) -> None:
        """Forget what was heard, and the episode."""
        self._begin = 0
        self._joiner.clear()
        self.last = None

    def would_be_here(self) -> bool:
        """Whether a view that was there before this node would have been heard by now."""
        if not all(heard.get_publisher_count() for heard in self._heard):
            return False
        now = time.monotonic()
        self._matched_at = now if self._matched_at is None else self._matched_at
        return now - self._matched_at >= FIND_VIEWS_S

    def _on(self, name: str, read: Callable[[Any], Any]) -> Callable[[Any], None]:
        def on_msg(msg: Any) -> None:
            with self._diagnostics.refusing():
                self._join(name, nanoseconds_from_stamp(msg.header.stamp), read(msg))
        return on_msg

    def _join(self, name: str, stamp: int, part: Any) -> None:
        if self._node.clock_watch.is_ahead(stamp):
            return
        if stamp < self._begin:
            self._diagnostics.count('dropped/last_episode')
            return
        parts = self._joiner.add(name, stamp, part)
        if parts is not None:
            self.last = HeardView(stamp, **parts)
            self._take(self.last)
