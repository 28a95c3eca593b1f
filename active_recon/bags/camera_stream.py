"""The camera of a bag as the reconstructor's node would have seen it: images joined to poses."""

from bisect import bisect_right
from collections.abc import Callable, Iterator
import math
from typing import Any

from active_recon.bags.message_types import (
    COMPRESSED_IMAGE,
    FLOAT,
    JOINT_STATE,
    message_from_cdr,
    POSE,
)
from active_recon.bags.raw import Bag, RawMessage
from active_recon.bags.topics import CameraTopics, Topics
from active_recon.cameras import Camera, CANONICAL_INTRINSICS, Intrinsics, orbit_camera
from active_recon.errors import DataError, MessageError
from active_recon.reporting import Advance, Reporting, silent
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.goals import joint_position_from_msg
from msg_tools.images import compressed_image_from_msg, image_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.views import View, ViewJoiner
import numpy as np
from numpy.typing import NDArray

IMAGE_ROLE, INFO_ROLE, POSE_ROLE = 'camera/image_raw', 'camera/camera_info', 'camera/pose'


def read_message(message: RawMessage) -> Any:
    """Return the message that the bytes are; DataError where they are none of its type."""
    where = f'{message.topic} at {message.received / 1e9:.3f} s'
    return message_from_cdr(message.data, message.type_name, where)


class CameraStream:
    """
    Reads the camera's topics of a bag.

    Poses are interpolated and refused as in the node. Where a bag has azimuths alone, or no
    camera info, the camera is the canonical one at that azimuth, and the shorter side of its
    image what the canonical camera sees. A Float64 bears no stamp: it and the images are then
    joined on their receive times. `received` tells when what bears a stamp was received, by the
    topic's name in the loop, nanoseconds.
    """

    def __init__(self, bag: Bag, camera: CameraTopics, topics: Topics,
                 reporting: Reporting = silent) -> None:
        self._bag = bag
        self._camera = camera
        self._topics = topics
        self._reporting = reporting
        self._unstamped = camera.azimuth.type_name == FLOAT
        self._lenses: list[tuple[int, Intrinsics]] = []
        self._poses: list[tuple[int, NDArray[np.float64]]] = []
        self.received: dict[str, dict[int, int]] = {
            IMAGE_ROLE: {}, INFO_ROLE: {}, POSE_ROLE: {}}

    def views(self, wanted: Callable[[int], bool]) -> Iterator[View | MessageError]:
        """
        Yield the images whose stamps are wanted, with their cameras, or why they are refused.

        Raises DataError where the images' times run backwards.
        """
        yield from self._read_cameras()
        with self._reporting('reading the images', self._camera.image.count) as advance:
            yield from self._joined(wanted, advance)

    def _joined(self, wanted: Callable[[int], bool], advance: Advance
                ) -> Iterator[View | MessageError]:
        joiner = ViewJoiner(self._topics.max_pose_gap)
        fed = 0
        for message in self._bag.messages({self._camera.image.name}):
            advance(1, '')
            msg = read_message(message)
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if not wanted(stamp):
                continue
            self.received[IMAGE_ROLE].setdefault(stamp, message.received)
            time = message.received if self._unstamped else stamp
            while fed < len(self._poses) and (fed == 0 or self._poses[fed - 1][0] < time):
                joiner.add_pose(*self._poses[fed])
                fed += 1
            try:
                image = (compressed_image_from_msg(msg)
                         if message.type_name == COMPRESSED_IMAGE else image_from_msg(msg))
                joiner.add_intrinsics(time, self._lens(time, *image.shape[:2]))
                joiner.add_image(time, image, now=0)
            except MessageError as error:
                if error.kind == 'out_of_order':
                    raise DataError(f'{message.topic}: the times run backwards: {error}',
                                    error.kind) from error
                yield error
                continue
            for view in joiner.joined(now=math.inf):  # what may come has come
                yield View(stamp, view.image, view.camera) if isinstance(view, View) else view

    def _read_cameras(self) -> Iterator[MessageError]:
        """Read the poses and lenses, in the order of their stamps; yield what is refused."""
        info, azimuth = self._camera.camera_info, self._camera.azimuth
        for message in self._bag.messages({azimuth.name, *([info.name] if info else ())}):
            msg = read_message(message)
            stamp = (message.received if message.type_name == FLOAT
                     else nanoseconds_from_stamp(msg.header.stamp))
            role = POSE_ROLE if message.topic == azimuth.name else INFO_ROLE
            self.received[role].setdefault(stamp, message.received)
            try:
                if role == POSE_ROLE:
                    self._poses.append((stamp, self._pose(msg)))
                else:
                    self._lenses.append((stamp, intrinsics_from_msg(msg)))
            except MessageError as error:
                yield error
        self._poses.sort(key=_stamp)
        self._lenses.sort(key=_stamp)

    def _pose(self, msg: Any) -> NDArray[np.float64]:
        kind = self._camera.azimuth.type_name
        if kind == POSE:
            pose = pose_from_msg(msg, self._topics.object_frame)
            if self._camera.camera_info:
                return pose
            return orbit_camera(Camera(pose).azimuth).pose
        azimuth = (joint_position_from_msg(msg, self._topics.joint) if kind == JOINT_STATE
                   else float(msg.data))
        if not math.isfinite(azimuth):
            raise MessageError(f'expected a finite azimuth, got {azimuth}', 'azimuth')
        return orbit_camera(-azimuth if self._topics.turned_object else azimuth).pose

    def _lens(self, time: int, height: int, width: int) -> Intrinsics:
        """Return the camera info of that time, or the last before it."""
        if self._lenses and self._camera.azimuth.type_name == POSE:
            return self._lenses[max(bisect_right(self._lenses, time, key=_stamp) - 1, 0)][1]
        side = min(height, width)
        focal = CANONICAL_INTRINSICS.fx * side / CANONICAL_INTRINSICS.width
        return Intrinsics(focal, focal, width / 2, height / 2, width, height)


def _stamp(entry: tuple[int, object]) -> int:
    return entry[0]
