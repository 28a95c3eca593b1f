"""The depth images in a bag that the loop took in with its views."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from active_recon.bags.runs.run import RecordedEpisode
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
from active_recon.volumes.depth_images import DepthImage
from msg_tools.cameras import intrinsics_from_msg
from msg_tools.compressed_depth import metres_from_msg
from msg_tools.stamps import nanoseconds_from_stamp

DEPTH_ROLE, DEPTH_INFO_ROLE = 'camera/depth/image_raw', 'camera/depth/camera_info'
_COMPRESSED = '/compressedDepth'


def with_depth(episodes: Sequence[RecordedEpisode], bag: Bag, namespace: str,
               names: Mapping[str, str], parameters: Mapping[str, Any]) -> list[RecordedEpisode]:
    """
    Return episodes whose views have the depth images that the reconstructor took in.

    That is the nearest to each view within its parameter `max_depth_gap`, if it had `use_depth`;
    what cannot be read was refused then, too. `names` are the full names of remapped topics.
    """
    if not parameters.get('use_depth', ReconstructorParameters.use_depth):
        return list(episodes)
    gap = round(1e9 * parameters.get('max_depth_gap', ReconstructorParameters.max_depth_gap))
    cameras = {view.stamp: view.camera for episode in episodes for view in episode.views}
    found = _nearest(bag, [names.get(role, f'{namespace}{role}')
                           for role in (DEPTH_ROLE, DEPTH_INFO_ROLE)], cameras, gap)
    return [replace(episode, views=[replace(view, depth=found.get(view.stamp))
                                    for view in episode.views]) for episode in episodes]


def _nearest(bag: Bag, topics: Sequence[str], cameras: Mapping[int, Camera],
             gap: int) -> dict[int, DepthImage]:
    """Return the depth image nearest to each stamp of `cameras`, nanoseconds, if within `gap`."""
    nearest: dict[int, tuple[int, Any]] = {}
    lens: Intrinsics | None = None
    depth, info = topics
    kinds = {depth: IMAGE, f'{depth}{_COMPRESSED}': COMPRESSED_IMAGE, info: CAMERA_INFO}
    for message in bag.messages(set(kinds)):
        wanted = kinds[message.topic]
        if message.type_name != wanted:
            raise DataError(f'{message.topic}: not the type of a depth camera: expected {wanted}, '
                            f'got {message.type_name}', 'topics')
        msg = read_message(message)
        if wanted == CAMERA_INFO:
            with suppress(MessageError):
                lens = lens or intrinsics_from_msg(msg)
            continue
        stamp = nanoseconds_from_stamp(msg.header.stamp)
        for view in cameras:
            away = abs(stamp - view)
            if away <= gap and (view not in nearest or away < nearest[view][0]):
                nearest[view] = away, msg
    found = {}
    for stamp, (_, msg) in nearest.items():
        camera = cameras[stamp]
        try:
            found[stamp] = DepthImage(metres_from_msg(msg),
                                      camera if lens is None else Camera(camera.pose, lens))
        except MessageError:
            continue
    return found
