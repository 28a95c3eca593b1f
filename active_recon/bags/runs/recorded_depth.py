"""The depth images in a bag beside its views: those that the loop took in, or those of a topic."""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

from active_recon.bags.runs.camera_stream import CameraStream
from active_recon.bags.runs.run import RecordedEpisode
from active_recon.bags.runs.topics import DepthTopics
from active_recon.bags.storage.bag import Bag
from active_recon.bags.storage.message_types import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    IMAGE,
    read_message,
)
from active_recon.errors import DataError, MessageError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.parameters.reconstructor import ReconstructorParameters
from active_recon.volumes.depth_images import DepthImage, registered
from msg_tools.cameras import intrinsics_from_msg
from msg_tools.compressed_depth import metres_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
from numpy.typing import NDArray

DEPTH_ROLE, DEPTH_INFO_ROLE = 'camera/depth/image_raw', 'camera/depth/camera_info'
_COMPRESSED = '/compressedDepth'
_SAME_POSE = 1e-6  # metres, and parts of unit vectors


class _Stamped(NamedTuple):
    stamp: int
    received: int
    msg: Any


def with_depth(episodes: Sequence[RecordedEpisode], bag: Bag, namespace: str,
               names: Mapping[str, str], parameters: Mapping[str, Any]) -> list[RecordedEpisode]:
    """
    Return episodes whose views have the depth images that the reconstructor took in.

    That is the nearest to each view within its parameter `max_depth_gap`, if it had `use_depth`;
    what cannot be read was refused then, too. `names` are the full names of remapped topics.
    """
    if not parameters.get('use_depth', ReconstructorParameters.use_depth):
        return list(episodes)
    gap = parameters.get('max_depth_gap', ReconstructorParameters.max_depth_gap)
    cameras = {view.stamp: view.camera for episode in episodes for view in episode.views}
    depth, info = (names.get(role, f'{namespace}{role}') for role in (DEPTH_ROLE, DEPTH_INFO_ROLE))
    kinds = {depth: IMAGE, f'{depth}{_COMPRESSED}': COMPRESSED_IMAGE, info: CAMERA_INFO}
    nearest, lenses = _nearest(bag, kinds, cameras, gap)
    found: dict[int, DepthImage] = {}
    for stamp, each in nearest.items():
        with suppress(MessageError):
            found[stamp] = _image(each, cameras[stamp], lenses)
    return [replace(episode, views=[replace(view, depth=found.get(view.stamp))
                                    for view in episode.views]) for episode in episodes]


def with_depth_of(depth: DepthTopics, episode: RecordedEpisode, bag: Bag, stream: CameraStream
                  ) -> RecordedEpisode:
    """
    Return an episode whose views have the nearest depth image of a topic, of another recorder.

    By transforms the depth is registered to the image's camera; without, it has to be. It is
    joined on receive times where images are. Raises DataError where the transforms do not connect
    the depth camera, and where no view has depth.
    """
    cameras = {view.stamp: view.camera for view in episode.views}
    kinds = {topic.name: topic.type_name for topic in (depth.images, depth.camera_info) if topic}
    gap = ReconstructorParameters.max_depth_gap
    nearest, lenses = _nearest(bag, kinds, cameras, gap, stream.are_images_unstamped)
    found: dict[int, DepthImage] = {}
    reason = f'expected some within {gap:g} s of an image, got none'
    for stamp, each in nearest.items():
        try:
            image = _image(each, cameras[stamp], lenses)
            if stream.transforms:
                image = _registered(image, stream.transformed(
                    each.msg.header.frame_id,
                    each.received if stream.is_unstamped else each.stamp))
            found[stamp] = image
        except MessageError as error:
            reason = str(error)
            if error.kind == 'tf':
                break
    if not found:
        raise DataError(f'{depth.images.name}: no depth for any view: {reason}', 'depth')
    return replace(episode, views=[replace(view, depth=found.get(view.stamp))
                                   for view in episode.views])


def _registered(image: DepthImage, pose: NDArray[np.float64]) -> DepthImage:
    """Return depth of a camera at a pose, (4, 4), as the image's camera would measure it."""
    assert image.camera is not None
    lens = image.camera.intrinsics
    if image.metres.shape != (lens.height, lens.width):
        return image  # refused with its view
    if np.allclose(pose, image.camera.pose, rtol=0, atol=_SAME_POSE):
        return image
    return registered(replace(image, camera=Camera(pose, lens)), image.camera.pose)


def _nearest(bag: Bag, kinds: Mapping[str, str], views: Collection[int], gap: float,
             by_receive_time: bool = False
             ) -> tuple[dict[int, _Stamped], list[tuple[int, Intrinsics]]]:
    """
    Return the depth message nearest to each view's stamp, nanoseconds, if within `gap` seconds.

    The second value are the depth camera's lenses in the order of their times. `kinds` are the
    types of the topics. Raises DataError on other types.
    """
    nearest: dict[int, _Stamped] = {}
    lenses: list[tuple[int, Intrinsics]] = []
    for message in bag.messages(set(kinds)):
        wanted = kinds[message.topic]
        if message.type_name != wanted:
            raise DataError(f'{message.topic}: not the type of a depth camera: expected {wanted}, '
                            f'got {message.type_name}', 'topics')
        msg = read_message(message)
        stamp = message.received if by_receive_time else nanoseconds_from_stamp(msg.header.stamp)
        if wanted == CAMERA_INFO:
            with suppress(MessageError):
                lenses.append((stamp, intrinsics_from_msg(msg)))
            continue
        for view in views:
            away = abs(stamp - view)
            if away <= round(gap * 1e9) and (view not in nearest
                                             or away < abs(nearest[view].stamp - view)):
                nearest[view] = _Stamped(stamp, message.received, msg)
    return nearest, sorted(lenses, key=itemgetter(0))


def _image(depth: _Stamped, camera: Camera, lenses: Sequence[tuple[int, Intrinsics]]
           ) -> DepthImage:
    """
    Return a message's depth beside an image of a camera; raises MessageError.

    Its lens is the last at or before it; without any it is the image's.
    """
    known = max(bisect_right(lenses, depth.stamp, key=itemgetter(0)) - 1, 0)
    return DepthImage(metres_from_msg(depth.msg),
                      Camera(camera.pose, lenses[known][1]) if lenses else camera)
