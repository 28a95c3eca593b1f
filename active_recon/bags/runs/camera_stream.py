"""The camera in a bag: images joined with poses as in the reconstructor's node."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from dataclasses import replace
import math
from typing import Any

from active_recon.bags.runs.recorded_transforms import RecordedTransforms
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import (
    CameraTopics,
    IMAGE_ROLE,
    INFO_ROLE,
    POSE_ROLE,
    POSE_TYPES,
    Topics,
)
from active_recon.bags.storage.bag import Bag
from active_recon.bags.storage.message_types import (
    FLOAT,
    JOINT_STATE,
    POSE,
    read_message,
    TRANSFORMS,
)
from active_recon.errors import DataError, MessageError
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, Intrinsics
from active_recon.reporting import Advance, Reporting, silent
from msg_tools.camera_images import size_from_msg
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.goals import joint_position_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.views import View, ViewJoiner
import numpy as np
from numpy.typing import NDArray

_AT_CENTRE = 1e-6  # metres


class CameraStream:
    """
    Reads the camera topics of a bag.

    Poses are interpolated and rejected as in the node; of transforms, that of an image's frame in
    the object's is looked up at its stamp. If the bag has azimuths only and the scene
    no camera position, or if it has no camera info of a calibrated camera, the camera is assumed
    at that azimuth on the scene's orbit, with a lens whose shorter side matches the canonical
    camera, or at the scene's position, with one as much longer as that is farther. Where images or
    azimuths have no stamps, they are joined on their receive times, and an image without one has
    its receive time as its stamp. Raises ConfigError if the topics or the scene tell what the bag
    has, DataError if the angle is of one of several joints.

    - assumed: in words, what neither the bag nor the scene states; complete once `views` ended
    - received: receive times by topic name in the loop and by stamp, nanoseconds
    - transforms: None where the bag has poses or azimuths instead
    - is_unstamped: receive times count instead of stamps; are_images_unstamped: also as stamps
    - images: stamp and receive time of each image read, wanted or not, nanoseconds
    - went_back: whether stamps of wanted images went back, where that was allowed
    """

    def __init__(self, bag: Bag, camera: CameraTopics, topics: Topics, scene: Scene,
                 reporting: Reporting = silent) -> None:
        self._bag = bag
        self._camera = camera
        self._topics = topics
        self._scene = scene
        self._reporting = reporting
        self.is_unstamped = self.are_images_unstamped = self.went_back = False
        self._image_frames: set[str] = set()
        self._joints: set[str] = set()
        self._lenses: list[tuple[int, Intrinsics]] = []
        self._unusable_lens = ''
        self._poses: list[tuple[int, NDArray[np.float64] | float]] = []
        self.transforms = (
            RecordedTransforms(topics.object_frame, topics.max_pose_gap)
            if camera.azimuth.type_name == TRANSFORMS else None)
        self.images: list[tuple[int, int]] = []
        self.assumed: list[str] = []
        self.received: dict[str, dict[int, int]] = {
            IMAGE_ROLE: {}, INFO_ROLE: {}, POSE_ROLE: {}}

    def views(self, wanted: Callable[[int], bool],
              in_order: bool = True) -> Iterator[View | MessageError]:
        """
        Yield the wanted images with their cameras, or the errors that reject them.

        Without `in_order` stamps may go back, as those of a loop do whose clock was reset.
        """
        yield from self._read_cameras()
        with self._reporting('reading the images', self._camera.image.count) as advance:
            yield from self._joined(wanted, in_order, advance)

    def transformed(self, frame: str, time: int) -> NDArray[np.float64]:
        """Return by transforms the pose of a frame, where that of the images is the camera's."""
        assert self.transforms is not None
        if frame in self._image_frames:
            frame = self._topics.camera_frame or frame
        return self._scene.about_object(self.transforms.pose(frame, time))

    def begins_after(self, stamp: int) -> bool:
        """Return whether an image of that stamp, or its camera, is from before the recording."""
        firsts = [entries[0][0] for entries in (self._poses, self._lenses)
                  if entries and not self.is_unstamped]
        return stamp < max(min(self.images)[0] if self.images else math.inf, *firsts)

    def _joined(self, wanted: Callable[[int], bool], in_order: bool, advance: Advance
                ) -> Iterator[View | MessageError]:
        joiner = ViewJoiner(self._topics.max_pose_gap)
        fed = last = 0
        for message in self._bag.messages({self._camera.image.name}):
            advance(1, '')
            msg = read_message(message)
            stamp = (message.received if self.are_images_unstamped
                     else nanoseconds_from_stamp(msg.header.stamp))
            self.images.append((stamp, message.received))
            self._image_frames.add(msg.header.frame_id)
            if not wanted(stamp):
                continue
            self.received[IMAGE_ROLE].setdefault(stamp, message.received)
            time = message.received if self.is_unstamped else stamp
            if time < last and not in_order:
                joiner.clear()
                fed, self.went_back = 0, True
            last = time
            # Of a fast tracker's poses only those around an image are of use
            fed = max(fed, bisect_left(self._poses, time, key=_stamp) - 1)
            try:
                while fed < len(self._poses) and (fed == 0 or self._poses[fed - 1][0] < time):
                    fed += 1
                    joiner.add_pose(self._poses[fed - 1][0], self._placed(self._poses[fed - 1][1]))
                if self.transforms:
                    joiner.add_pose(time, self._placed(self.transforms.pose(
                        self._topics.camera_frame or msg.header.frame_id, time)))
                joiner.add_intrinsics(time, self._lens(time, *size_from_msg(msg)))
                joiner.add_image(time, msg, now=0)
            except MessageError as error:
                yield error
                continue
            for view in joiner.joined(now=math.inf):  # nothing more is to come
                yield replace(view, stamp=stamp) if isinstance(view, View) else view

    def _read_cameras(self) -> Iterator[MessageError]:
        """Read the poses and lenses and sort them by their stamps; yield the errors."""
        info, azimuth, static = (self._camera.camera_info, self._camera.azimuth,
                                 self._camera.static)
        read = [topic for topic in (azimuth, static, info) if topic]
        poses: list[tuple[int, int, NDArray[np.float64] | float]] = []
        lenses: list[tuple[int, int, Intrinsics]] = []
        with self._reporting('reading the cameras', sum(each.count for each in read)) as advance:
            for message in self._bag.messages({topic.name for topic in read}):
                advance(1, '')
                msg = read_message(message)
                if self.transforms and message.type_name == TRANSFORMS:
                    yield from self.transforms.read(msg, message)
                    continue
                stamp = (0 if message.type_name == FLOAT
                         else nanoseconds_from_stamp(msg.header.stamp))
                role = POSE_ROLE if message.topic == azimuth.name else INFO_ROLE
                if message.type_name == JOINT_STATE:
                    self._joints.update(msg.name)
                    if self._topics.joint and msg.name and self._topics.joint not in msg.name:
                        continue  # of another publisher's joints, as an arm's
                self.received[role].setdefault(stamp, message.received)
                try:
                    if role == POSE_ROLE:
                        poses.append((stamp, message.received, self._pose(msg)))
                    else:
                        lenses.append((stamp, message.received, intrinsics_from_msg(msg)))
                except MessageError as error:
                    # Of an image there may be another camera info: the message is left out
                    if role == INFO_ROLE:
                        self._unusable_lens = self._unusable_lens or str(error)
                    yield error if role == POSE_ROLE else MessageError(
                        str(error), 'unusable_camera_info')
        self._require_one_joint()
        self.are_images_unstamped = not any(
            nanoseconds_from_stamp(read_message(message).header.stamp)
            for message in self._bag.messages({self._camera.image.name}))
        stamps = (self.transforms.stamps if self.transforms
                  else [stamp for stamp, *_ in poses])
        self.is_unstamped = self.are_images_unstamped or bool(stamps) and not any(stamps)
        self._poses = [(received if self.is_unstamped else stamp, pose)
                       for stamp, received, pose in poses]
        self._lenses = [(received if self.is_unstamped else stamp, lens)
                        for stamp, received, lens in lenses]
        self._place()
        if self.transforms:
            self.transforms.finish(by_receive_time=self.is_unstamped)
        self._poses.sort(key=_stamp)
        self._lenses.sort(key=_stamp)

    def _pose(self, msg: Any) -> NDArray[np.float64] | float:
        """Return the camera's pose, or its azimuth where the bag has no more."""
        kind = self._camera.azimuth.type_name
        if kind == POSE:
            return pose_from_msg(
                msg, self._topics.object_frame, 'name it with --object-frame, and with '
                '--object-position where the object is in it',
                at_origin=self._scene.object_position is not None)
        if kind == JOINT_STATE:
            angle = joint_position_from_msg(msg, self._topics.joint)
        else:
            angle = float(msg.data)
        if not math.isfinite(angle):
            raise MessageError(f'azimuth not finite: got {angle}', 'azimuth')
        return angle

    def _require_one_joint(self) -> None:
        """Raise DataError where it is open which of several joints, of any message, is meant."""
        if self._topics.joint and self._joints and self._topics.joint not in self._joints:
            raise DataError(f'no joint {self._topics.joint} on {self._camera.azimuth.name}: '
                            f'expected one of {", ".join(sorted(self._joints))}', 'joint')
        if len(self._joints) > 1 and not self._topics.joint:
            raise DataError(f'several joints on {self._camera.azimuth.name}, '
                            f'{", ".join(sorted(self._joints))}: choose one with --joint'
                            f'{self._camera.advice}', 'joint')

    def _place(self) -> None:
        """Decide how much of the camera is known; raise ConfigError on redundant options."""
        scene, azimuth = self._scene, self._camera.azimuth
        has_poses, recorded = azimuth.type_name in POSE_TYPES, bool(self._lenses)
        if not has_poses and scene.camera_position is None:
            self._lenses.clear()  # at an unknown distance a lens is of no use
        self._topics.reject_redundant(azimuth)
        scene.reject_redundant(azimuth.name, has_poses, has_poses and bool(self._lenses))
        self.assumed = scene.assumed(self._camera.image.name, has_poses, recorded)
        if self._unusable_lens and not recorded:
            self.assumed.append(f'of the recorded camera info nothing: {self._unusable_lens}')

    def _placed(self, known: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Return the pose, or one on the orbit if no lens is known; raises MessageError."""
        pose = (self._scene.pose_at(known, self._topics.turned_object)
                if isinstance(known, float) else self._scene.about_object(known))
        if np.linalg.norm(pose[:3, 3]) < _AT_CENTRE:
            raise MessageError("invalid camera pose: it is at the object's centre, which "
                               '--object-frame and --object-position set', 'pose')
        if self._lenses or self._scene.camera_position is not None:
            return pose
        return self._scene.orbit_pose(Camera(pose).azimuth)

    def _lens(self, time: int, height: int, width: int) -> Intrinsics:
        """Return the last camera info at or before a time, else an assumed lens."""
        if self._lenses:
            return self._lenses[max(bisect_right(self._lenses, time, key=_stamp) - 1, 0)][1]
        side = min(height, width)
        focal = (self._scene.canonical_distances * CANONICAL_INTRINSICS.fx * side
                 / CANONICAL_INTRINSICS.width)
        return Intrinsics(focal, focal, width / 2, height / 2, width, height)


def _stamp(entry: tuple[int, object]) -> int:
    return entry[0]
