"""Which topics of a bag are the camera, its azimuth and the loop's own."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.bags.runs.image_kinds import what_else
from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.storage.message_types import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    FLOAT,
    IMAGE,
    JOINT_STATE,
    POSE,
)
from active_recon.bags.storage.raw import Bag, BagSummary
from active_recon.errors import ConfigError, DataError

IMAGE_TYPES = (IMAGE, COMPRESSED_IMAGE)
AZIMUTH_TYPES = (POSE, JOINT_STATE, FLOAT)
IMAGE_ROLE, INFO_ROLE, POSE_ROLE = 'camera/image_raw', 'camera/camera_info', 'camera/pose'
_ROLES = (IMAGE_ROLE, INFO_ROLE, POSE_ROLE)
_OF_THE_LOOP = ('/view', '/view_image', '/latent', '/camera/mask', '/next_view', '/next_azimuth',
                '/entropy')


@dataclass(frozen=True)
class Topics:
    """
    Where a bag has what a view needs; '' finds it by its name in the loop or by its type.

    - image: sensor_msgs Image or CompressedImage; camera_info: sensor_msgs CameraInfo
    - azimuth: geometry_msgs PoseStamped of the camera; or radians, as a sensor_msgs JointState or
      a std_msgs Float64
    - joint: of the JointState, where it has several
    - turned_object: the radians are a turntable's under a fixed camera, whose azimuth is minus it
    - object_frame: in which a PoseStamped is expected
    - max_pose_gap: seconds from an image to a pose that is interpolated, as in the node
    """

    image: str = ''
    camera_info: str = ''
    azimuth: str = ''
    joint: str = ''
    turned_object: bool = False
    object_frame: str = 'object'
    max_pose_gap: float = 0.1

    def __post_init__(self) -> None:
        """Refuse a gap that is none."""
        if not 0 <= self.max_pose_gap < math.inf:
            raise ConfigError('max_pose_gap: expected seconds from 0 on, got '
                              f'{self.max_pose_gap}')


@dataclass(frozen=True)
class CameraTopics:
    """
    The topics of the camera; `azimuth` bears the pose, or just the azimuth.

    `of_views`: the camera's own images were not recorded, and these are what the network saw of
    them, one of each view.
    """

    image: TopicSummary
    camera_info: TopicSummary | None
    azimuth: TopicSummary
    of_views: bool = False


def loop_namespace(present: Sequence[TopicSummary]) -> str | None:
    """Return what stands before the loop's topics, '/' or '/robot/'; None: no view was taken."""
    namespaces = [topic.name.removesuffix('view') for topic in present
                  if topic.name.endswith('/view') and topic.type_name == POSE and topic.count]
    if len(namespaces) > 1:
        raise DataError(f'views of several loops, in {", ".join(namespaces)}: expected the topics '
                        'of one loop in a bag')
    return namespaces[0] if namespaces else None


def camera_topics(bag: Bag, summary: BagSummary, topics: Topics) -> CameraTopics:
    """
    Return the camera's topics; DataError that says all that is missing or cannot be told apart.

    A topic is found by its option, else by the name that it had for the loop's nodes, which the
    recorder notes where it was another than their own, else by its name in the loop, else by its
    type and by what its first message shows. What the nodes heard as something else is none.
    """
    if not any(topic.count for topic in summary.topics):
        raise DataError('no messages in it: the bag is empty', 'empty')
    search = _Search(bag, summary)
    missing = []
    try:
        image, of_views = search.image(topics.image)
    except DataError as error:
        missing.append(error)
    try:
        azimuth = search.azimuth(topics.azimuth, loops_own=not missing and of_views)
    except DataError as error:
        missing.append(error)
    if missing:
        raise DataError('; '.join(map(str, missing)), 'topics')
    return CameraTopics(image, search.camera_info(topics.camera_info, image), azimuth, of_views)


class _Search:
    """Looks for the topics of one bag."""

    def __init__(self, bag: Bag, summary: BagSummary) -> None:
        self._bag = bag
        self._recorded_as = summary.provenance
        others = {full for name, full in summary.provenance.items()
                  if name.partition('/compressed')[0] not in _ROLES}
        self._present = [topic for topic in summary.topics
                         if topic.count and topic.name not in others]

    def image(self, name: str) -> tuple[TopicSummary, bool]:
        """Return the topic of the images, and whether they are those that the network saw."""
        fitting = self._fitting(name, IMAGE_TYPES)
        usual = self._known_by_name(name, fitting, IMAGE_ROLE)
        # A message is read only where names leave a doubt
        others = {} if usual else what_else(self._bag, fitting)
        cameras = usual or [topic for topic in fitting if topic.name not in others]
        if cameras:
            return _only(cameras, IMAGE_TYPES, "a camera's images", '--image'), False
        seen = [topic for topic in self._present
                if topic.name.endswith('/view_image') and topic.type_name == IMAGE]
        if len(seen) == 1 and not name:
            return seen[0], True
        instead = f' ({", ".join(f"{topic} has {what}" for topic, what in others.items())})'
        raise DataError(
            f'no camera images on {name or "any topic"}{instead if others else ""}: expected '
            f'{" or ".join(IMAGE_TYPES)}; name the topic with --image', 'topics')

    def azimuth(self, name: str, loops_own: bool) -> TopicSummary:
        """Return the topic of the poses or azimuths; `loops_own`: that of the views alone."""
        views = [topic for topic in self._present
                 if topic.name.endswith('/view') and topic.type_name == POSE]
        fitting = self._fitting(name, AZIMUTH_TYPES)
        found = (views if loops_own and not name else None) or self._known_by_name(
            name, fitting, POSE_ROLE) or fitting or views
        if not found or name and not fitting:
            raise DataError(f"no camera poses or azimuths on {name or 'any topic'}: expected "
                            f'{" or ".join(AZIMUTH_TYPES)}; name the topic with --azimuth',
                            'topics')
        return _only(found, AZIMUTH_TYPES, "the camera's poses or azimuths", '--azimuth')

    def camera_info(self, name: str, image: TopicSummary) -> TopicSummary | None:
        """Return the topic of the camera info; None: there is none, or none was named."""
        fitting = self._fitting(name, (CAMERA_INFO,))
        beside = f'{image.name.removesuffix("/compressed").rpartition("/")[0]}/camera_info'
        found = self._known_by_name(name, fitting, INFO_ROLE) or [
            topic for topic in fitting if topic.name == beside] or fitting
        if not found and name:
            raise DataError(f'no camera info on {name}: expected {CAMERA_INFO}; name the topic '
                            'with --camera-info', 'topics')
        return _only(found, (CAMERA_INFO,), 'camera info', '--camera-info') if found else None

    def _fitting(self, name: str, types: Sequence[str]) -> list[TopicSummary]:
        """Return the topics of the types: that of the name, else all but the loop's own."""
        return [topic for topic in self._present if topic.type_name in types and (
            topic.name == name if name else not topic.name.endswith(_OF_THE_LOOP))]

    def _known_by_name(self, name: str, fitting: Sequence[TopicSummary],
                       usual: str) -> list[TopicSummary]:
        """Return those that an option, or the recorder's note, or the usual name tells."""
        if name:
            return list(fitting)
        heard = self._recorded_as.get(usual, '')
        return ([topic for topic in fitting if heard in (topic.name, topic.name.removesuffix(
            '/compressed'))] or [topic for topic in fitting if topic.name.endswith(f'/{usual}')])


def _only(topics: Sequence[TopicSummary], types: Sequence[str], what: str,
          option: str) -> TopicSummary:
    """Return the one of the first type that there is, since the first tells most."""
    for kind in types:
        candidates = [topic for topic in topics if topic.type_name == kind]
        if len(candidates) == 1:
            return candidates[0]
        if candidates:
            raise DataError(f'{what} on several topics, '
                            f'{", ".join(topic.name for topic in candidates)}: choose one with '
                            f'{option}', 'topics')
    raise AssertionError('topics were chosen by their types')
