"""A view out of its streams: image, camera info, pose and mask, joined on their stamps."""

import bisect
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from active_recon.errors import MessageError
from active_recon.geometry.cameras import Camera, Intrinsics
from msg_tools.camera_images import pixels_from_msg, size_from_msg
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp
from sensor_msgs.msg import CompressedImage, Image

_KEPT = 1024  # poses: five seconds of a fast tracker
_KEPT_INFOS = 256  # those of a fast camera while its images are late
_WAITING = 32  # images, as long as they are not larger than
_WAITING_BYTES = 1 << 28  # all together
Part = TypeVar('Part')


@dataclass(frozen=True, eq=False)
class View:
    """
    An image, (H, W, 3) uint8 RGB, and the camera that took it, at a stamp in nanoseconds.

    With the mask of its object, still unread, where masks are joined and one came.
    """

    stamp: int
    image: NDArray[np.uint8]
    camera: Camera
    mask: Image | None = None


@dataclass(frozen=True, eq=False)
class UnreadView:
    """A view whose image is still the message that came, so that nothing is unpacked in vain."""

    stamp: int
    image: Image | CompressedImage
    camera: Camera
    mask: Image | None = None

    def read(self) -> View:
        """Unpack the image; raises MessageError where it cannot be."""
        return View(self.stamp, pixels_from_msg(self.image), self.camera, self.mask)


@dataclass(frozen=True, eq=False)
class _WaitingImage:
    stamp: int
    msg: Image | CompressedImage
    size: tuple[int, int]
    arrived: float


class ViewJoiner:
    """
    Joins what arrives in any order; stamps are nanoseconds, `now` any clock in seconds.

    The camera info is that of the image's stamp. The pose is too, or is interpolated between its
    neighbours, each at most `max_pose_gap` seconds away. An image waits for them until they can
    no longer come: a later one is there, or `patience` seconds have passed. With `masks` it waits
    in the same way for the mask of its stamp, without which it may still be joined.
    `max_pose_gap` may be changed at any time.
    """

    def __init__(self, max_pose_gap: float, patience: float = 0.5, masks: bool = False) -> None:
        self.max_pose_gap = max_pose_gap
        self._patience = patience
        self._with_masks = masks
        self.clear()

    def clear(self, earliest: int = 0) -> None:
        """
        Forget everything, the order of stamps included.

        What is stamped before `earliest` and still comes is of no use from now on: an image is
        refused, the rest is left out.
        """
        self._earliest = earliest
        self._last_image = earliest - 1
        self._images: deque[_WaitingImage] = deque()
        self._intrinsics: deque[tuple[int, Intrinsics]] = deque(maxlen=_KEPT_INFOS)
        self._masks: deque[tuple[int, Image]] = deque(maxlen=_WAITING)
        self._poses: list[tuple[int, NDArray[np.float64]]] = []

    def add_image(self, stamp: int, msg: Image | CompressedImage, now: float) -> None:
        """
        Take in an image as it came.

        Raises MessageError where `size_from_msg` does, and on an image that came before or is
        older than the last.
        """
        size = size_from_msg(msg)
        if stamp == self._last_image:
            raise MessageError(f'expected each image once, got that of {_seconds(stamp)} again',
                               'duplicate')
        if stamp < self._last_image:
            raise MessageError(
                f'expected images in the order of their stamps, got {_seconds(stamp)} after '
                f'{_seconds(self._last_image)}; a new episode forgets the order', 'out_of_order')
        self._last_image = stamp
        self._images.append(_WaitingImage(stamp, msg, size, now))

    def add_intrinsics(self, stamp: int, intrinsics: Intrinsics) -> None:
        if stamp >= self._earliest:
            self._intrinsics.append((stamp, intrinsics))

    def add_mask(self, stamp: int, mask: Image) -> None:
        """Take in the mask of the image of that stamp, as it came."""
        if stamp >= self._earliest:
            self._masks.append((stamp, mask))

    def add_pose(self, stamp: int, pose: NDArray[np.float64]) -> None:
        """Take in a pose, (4, 4), object from optical frame."""
        if stamp < self._earliest:
            return
        bisect.insort(self._poses, (stamp, pose), key=lambda entry: entry[0])
        del self._poses[:-_KEPT]

    def joined(self, now: float) -> Iterator[UnreadView | MessageError]:
        """Yield what has been decided since the last call, in the images' order."""
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
                height, width = image.size
                if (intrinsics.height, intrinsics.width) != (height, width):
                    raise MessageError(
                        f"expected camera info of the image's size, {height} x {width}, "
                        f'got {intrinsics.height} x {intrinsics.width}', 'camera_info')
            except MessageError as error:
                self._drop_first()
                yield error
                continue
            self._drop_first()
            yield UnreadView(stamp, image.msg, Camera(pose, intrinsics), mask)

    def _are_too_many(self) -> bool:
        return len(self._images) > _WAITING or (
            len(self._images) > 1
            and sum(len(image.msg.data) for image in self._images) > _WAITING_BYTES)

    def _drop_first(self) -> None:
        """Forget the first image, and the masks that no later one can want: they are large."""
        stamp = self._images.popleft().stamp
        while self._masks and self._masks[0][0] <= stamp:
            self._masks.popleft()

    def _intrinsics_at(self, stamp: int, late: bool) -> Intrinsics | None:
        """Return the camera info of that stamp, None while it may still come."""
        intrinsics = _of_stamp(self._intrinsics, stamp)
        if intrinsics is None and _is_past(self._intrinsics, stamp, late):
            came = (f'the last is of {_seconds(self._intrinsics[-1][0])}' if self._intrinsics
                    else 'none came')
            raise MessageError("expected camera info of the image's stamp, "
                               f'{_seconds(stamp)}, {came}', 'no_camera_info')
        return intrinsics

    def _pose_at(self, stamp: int, late: bool) -> NDArray[np.float64] | None:
        """Return the pose at that stamp, None while it or its later neighbour may still come."""
        after = bisect.bisect_left(self._poses, stamp, key=lambda entry: entry[0])
        if after < len(self._poses):
            later, pose = self._poses[after]
            if later == stamp:
                return pose
            if after > 0:
                earlier, pose_before = self._poses[after - 1]
                if max(later - stamp, stamp - earlier) <= round(self.max_pose_gap * 1e9):
                    return interpolated(pose_before, pose, (stamp - earlier) / (later - earlier))
            late = True
        if not late:
            return None
        distances = [abs(known - stamp) for known, _ in self._poses[max(after - 1, 0):after + 1]]
        came = f'the nearest is {min(distances) / 1e9:.3f} s away' if distances else 'none came'
        raise MessageError(
            f"expected a pose of the image's stamp, {_seconds(stamp)}, or one before and one "
            f'after it within {self.max_pose_gap:g} s, {came}', 'no_pose')


def interpolated(start: NDArray[np.float64], end: NDArray[np.float64],
                 fraction: float) -> NDArray[np.float64]:
    """Return the pose, (4, 4), between two: positions on the line, rotations by slerp."""
    rotations = Rotation.from_matrix(np.stack([start[:3, :3], end[:3, :3]]))
    pose = np.eye(4)
    pose[:3, :3] = Slerp([0, 1], rotations)(fraction).as_matrix()
    pose[:3, 3] = (1 - fraction) * start[:3, 3] + fraction * end[:3, 3]
    return pose


def _of_stamp(parts: Sequence[tuple[int, Part]], stamp: int) -> Part | None:
    """Return the last part that came of that stamp, None where there is none."""
    return next((part for known, part in reversed(parts) if known == stamp), None)


def _is_past(parts: Sequence[tuple[int, object]], stamp: int, late: bool) -> bool:
    """Return whether a part of that stamp can come no longer."""
    return late or bool(parts and parts[-1][0] > stamp)


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.3f} s'
