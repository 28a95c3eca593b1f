"""Views joined from their streams: image, camera info, pose, mask and depth of one stamp."""

import bisect
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
import math
from typing import TypeVar

from active_recon.errors import MessageError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.geometry.rotations import pose_between
from msg_tools.camera_images import pixels_from_msg, reduced_from_msg, size_from_msg
from msg_tools.missing_parts import no_camera_info, no_pose, seconds
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image

_MAX_POSES = 1024  # five seconds of a fast tracker
_MAX_INFOS = 256  # of a fast camera while its images are late
_MAX_WAITING = 32  # images
_MAX_WAITING_BYTES = 1 << 28  # of all waiting images
NOT_BEGUN = 'not_begun'
"""Kind of the error of an image from just before the first pose or camera info."""
PATIENCE_S = 0.5
"""How long images wait for the other messages of their stamps."""
Part = TypeVar('Part')


@dataclass(frozen=True, eq=False)
class View:
    """
    An image and the camera that took it, at a stamp in nanoseconds.

    The image is decoded when it is first asked for. `mask` is the mask message of its object, if
    masks are joined and one was received; `depth` likewise.
    """

    stamp: int
    image_msg: Image | CompressedImage
    camera: Camera
    mask: Image | None = None
    depth: Image | CompressedImage | None = None

    @cached_property
    def image(self) -> NDArray[np.uint8]:
        """The image, (H, W, 3) uint8 RGB; raises MessageError if it cannot be decoded."""
        return pixels_from_msg(self.image_msg)

    def reduced(self, by: int) -> tuple[NDArray[np.uint8], Camera]:
        """
        Return the image reduced by 1, 2, 4 or 8 where that saves decoding it, and its camera.

        Raises MessageError as `image` does.
        """
        image = reduced_from_msg(self.image_msg, by)
        lens = self.camera.intrinsics
        if by == 1 or image.shape[:2] == (lens.height, lens.width):
            return image, self.camera
        return image, Camera(self.camera.pose, lens.reduced(by))


@dataclass(frozen=True, eq=False)
class _WaitingImage:
    stamp: int
    msg: Image | CompressedImage
    size: tuple[int, int]
    arrived: float


class ViewJoiner:
    """
    Joins messages that arrive in any order; stamps are nanoseconds, `now` any clock in seconds.

    An image is joined with the camera info of its stamp, and with the pose of its stamp or one
    interpolated between two neighbours, each at most `max_pose_gap` seconds away. It waits for
    them until a later one is there or `patience` seconds have passed. With `masks` it waits in
    the same way for the mask of its stamp, but is joined without it too; with a `max_depth_gap`
    of 0 seconds or more also for the nearest depth image within that. `max_pose_gap` may be
    changed at any time.

    Streams begin one after the other: an image from up to `patience` seconds before the first
    pose or camera info is no fault of the camera's, and its error is of the kind `NOT_BEGUN`.
    """

    def __init__(self, max_pose_gap: float, patience: float = PATIENCE_S, masks: bool = False,
                 max_depth_gap: float | None = None) -> None:
        self.max_pose_gap = max_pose_gap
        self._max_depth_gap = max_depth_gap
        self._patience = patience
        self._with_masks = masks
        self.clear()

    def clear(self, earliest: int = 0) -> None:
        """
        Forget everything, including the order of stamps.

        From now on images with stamps before `earliest` are rejected, and other messages ignored.
        """
        self._earliest = earliest
        self._last_image = earliest - 1
        self._images: deque[_WaitingImage] = deque()
        self._intrinsics: deque[tuple[int, Intrinsics]] = deque(maxlen=_MAX_INFOS)
        self._masks: deque[tuple[int, Image]] = deque(maxlen=_MAX_WAITING)
        self._depths: deque[tuple[int, Image | CompressedImage]] = deque(maxlen=_MAX_WAITING)
        self._poses: list[tuple[int, NDArray[np.float64]]] = []
        self._last_pose = earliest - 1
        self._first_intrinsics: float = math.inf
        self._first_pose: float = math.inf
        self._ignored_intrinsics: int | None = None
        self._ignored_poses: list[int] = []

    def add_image(self, stamp: int, msg: Image | CompressedImage, now: float) -> None:
        """
        Add an image message.

        Raises MessageError as `size_from_msg` does, and on a stamp that is not after the last.
        """
        size = size_from_msg(msg)
        if stamp == self._last_image:
            raise MessageError(f'duplicate image: got that of {seconds(stamp)} again',
                               'duplicate')
        if stamp < self._last_image:
            raise MessageError(
                f'image out of order: expected increasing stamps, got {seconds(stamp)} after '
                f'{seconds(self._last_image)}; a new episode resets the order', 'out_of_order')
        self._last_image = stamp
        self._images.append(_WaitingImage(stamp, msg, size, now))

    def add_intrinsics(self, stamp: int, intrinsics: Intrinsics) -> None:
        if stamp < self._earliest:
            self._ignored_intrinsics = stamp
            return
        self._intrinsics.append((stamp, intrinsics))
        self._first_intrinsics = min(self._first_intrinsics, stamp)

    def add_mask(self, stamp: int, mask: Image) -> None:
        """Add the mask message of the image of that stamp; raises MessageError without one."""
        self._require_stamp(stamp, 'mask')
        if stamp >= self._earliest:
            self._masks.append((stamp, mask))

    def add_depth(self, stamp: int, depth: Image | CompressedImage) -> None:
        """Add a depth image message; raises MessageError where it has no stamp."""
        self._require_stamp(stamp, 'depth image')
        if stamp >= self._earliest:
            self._depths.append((stamp, depth))

    def add_pose(self, stamp: int, pose: NDArray[np.float64]) -> None:
        """Add a pose, (4, 4), object from optical frame."""
        if stamp < self._earliest:
            self._ignored_poses = [stamp]
            return
        self._last_pose = stamp
        bisect.insort(self._poses, (stamp, pose), key=lambda entry: entry[0])
        del self._poses[:-_MAX_POSES]
        self._first_pose = min(self._first_pose, stamp)

    @property
    def is_waiting(self) -> bool:
        """Whether an image waits for the other messages of its stamp."""
        return bool(self._images)

    def joined(self, now: float) -> Iterator[View | MessageError]:
        """Yield new views, and errors of rejected images, in the order of the images."""
        while self._images:
            image = self._images[0]
            stamp = image.stamp
            late = now - image.arrived > self._patience or self._are_too_many()
            try:
                intrinsics = self._intrinsics_at(stamp, late)
                pose = self._pose_at(stamp, late) if intrinsics else None
                if intrinsics is None or pose is None:
                    return
                mask = _of_stamp(self._masks, stamp) if self._with_masks else None
                if self._with_masks and mask is None and not _is_past(self._masks, stamp, late):
                    return
                depth = None
                if self._max_depth_gap is not None:
                    if not _is_past(self._depths, stamp - 1, late):
                        return
                    depth = nearest_part(self._depths, stamp, self._max_depth_gap)
                height, width = image.size
                if (intrinsics.height, intrinsics.width) != (height, width):
                    raise MessageError(
                        f'wrong image size in camera info: expected {width} x {height}, '
                        f'got {intrinsics.width} x {intrinsics.height}', 'camera_info')
            except MessageError as error:
                self._drop_first()
                yield error
                continue
            self._drop_first()
            yield View(stamp, image.msg, Camera(pose, intrinsics), mask, depth)

    def _require_stamp(self, stamp: int, what: str) -> None:
        if stamp == 0 < self._earliest:
            raise MessageError(f'{what} without a stamp: expected that of its image, got 0; let '
                               'its publisher fill in header.stamp', 'no_stamp')

    def _are_too_many(self) -> bool:
        return len(self._images) > _MAX_WAITING or (
            len(self._images) > 1
            and sum(len(image.msg.data) for image in self._images) > _MAX_WAITING_BYTES)

    def _drop_first(self) -> None:
        """Forget the first image and its mask, as well as older masks and depth images."""
        stamp = self._images.popleft().stamp
        while self._masks and self._masks[0][0] <= stamp:
            self._masks.popleft()
        while len(self._depths) > 1 and self._depths[1][0] <= stamp:
            self._depths.popleft()

    def _intrinsics_at(self, stamp: int, late: bool) -> Intrinsics | None:
        """Return the camera info of that stamp, None while it may still arrive."""
        intrinsics = _of_stamp(self._intrinsics, stamp)
        if intrinsics is None and _is_past(self._intrinsics, stamp, late):
            last = self._intrinsics[-1][0] if self._intrinsics else self._ignored_intrinsics
            raise MessageError(no_camera_info(stamp, last),
                               self._kind('no_camera_info', stamp, self._first_intrinsics))
        return intrinsics

    def _pose_at(self, stamp: int, late: bool) -> NDArray[np.float64] | None:
        """Return the pose at that stamp, None while it or a later one may still arrive."""
        after = bisect.bisect_left(self._poses, stamp, key=lambda entry: entry[0])
        if after < len(self._poses):
            later, pose = self._poses[after]
            if later == stamp:
                return pose
            if after > 0:
                earlier, pose_before = self._poses[after - 1]
                if max(later - stamp, stamp - earlier) <= round(self.max_pose_gap * 1e9):
                    return pose_between(pose_before, pose, (stamp - earlier) / (later - earlier))
            # The last to come, not the latest: one stamped far ahead would let no image wait
            late |= self._last_pose > stamp
        if not late:
            return None
        nearby = [known for known, _ in self._poses[max(after - 1, 0):after + 1]]
        raise MessageError(no_pose(stamp, nearby or self._ignored_poses, self.max_pose_gap),
                           self._kind('no_pose', stamp, self._first_pose))

    def _kind(self, kind: str, stamp: int, first: float) -> str:
        """Return the kind of error of an image that lacks a part of which `first` is the first."""
        return NOT_BEGUN if 0 < first - stamp <= self._patience * 1e9 else kind


def nearest_part(parts: Sequence[tuple[int, Part]], stamp: int, gap: float) -> Part | None:
    """Return the part whose stamp is nearest, None where it is more than `gap` seconds away."""
    nearest = min(parts, key=lambda each: abs(each[0] - stamp), default=None)
    if nearest is None or abs(nearest[0] - stamp) > round(gap * 1e9):
        return None
    return nearest[1]


def _of_stamp(parts: Sequence[tuple[int, Part]], stamp: int) -> Part | None:
    """Return the last part received with that stamp, None if there is none."""
    return next((part for known, part in reversed(parts) if known == stamp), None)


def _is_past(parts: Sequence[tuple[int, object]], stamp: int, late: bool) -> bool:
    """Return whether a part of that stamp can no longer arrive."""
    return late or bool(parts and parts[-1][0] > stamp)
