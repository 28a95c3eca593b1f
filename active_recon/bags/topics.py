"""Which topics of a bag are the camera, its azimuth and the loop's own."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.bags.message_types import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    FLOAT,
    IMAGE,
    JOINT_STATE,
    POSE,
)
from active_recon.bags.run import TopicSummary
from active_recon.errors import ConfigError, DataError

IMAGE_TYPES = (IMAGE, COMPRESSED_IMAGE)
AZIMUTH_TYPES = (POSE, JOINT_STATE, FLOAT)


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
    """The topics of the camera; `azimuth` bears the pose, or just the azimuth."""

    image: TopicSummary
    camera_info: TopicSummary | None
    azimuth: TopicSummary


def loop_namespace(present: Sequence[TopicSummary]) -> str | None:
    """Return what stands before the loop's topics, '/' or '/robot/'; None: no view was taken."""
    namespaces = [topic.name.removesuffix('view') for topic in present
                  if topic.name.endswith('/view') and topic.type_name == POSE and topic.count]
    if len(namespaces) > 1:
        raise DataError('expected the topics of one loop in a bag, got views in '
                        f'{", ".join(namespaces)}')
    return namespaces[0] if namespaces else None


def camera_topics(present: Sequence[TopicSummary], topics: Topics) -> CameraTopics:
    """Return the camera's topics; DataError that says what is missing or cannot be told apart."""
    if not sum(topic.count for topic in present):
        raise DataError('expected a bag with messages, got an empty one', 'empty')
    image = _found(present, topics.image, 'camera/image_raw', IMAGE_TYPES, 'images', '--image')
    azimuth = _found(present, topics.azimuth, 'camera/pose', AZIMUTH_TYPES,
                     "the camera's poses or azimuths", '--azimuth')
    info = _found(present, topics.camera_info, 'camera/camera_info', (CAMERA_INFO,),
                  'camera info', '--camera-info', required=False)
    assert image is not None and azimuth is not None
    return CameraTopics(image, info, azimuth)


def _found(present: Sequence[TopicSummary], name: str, usual: str, types: Sequence[str],
           what: str, option: str, required: bool = True) -> TopicSummary | None:
    """Return the topic of that name, else the one that has the usual name, else the only one."""
    fitting = [topic for topic in present if topic.type_name in types and topic.count
               and not topic.name.endswith((
                   '/latent', '/view_image', '/camera/mask', '/next_view', '/next_azimuth',
                   '/entropy'))]
    if name:
        fitting = [topic for topic in present if topic.name == name and topic.type_name in types]
    elif named := [topic for topic in fitting if topic.name.endswith(f'/{usual}')]:
        fitting = named
    for kind in types:  # the first kind tells most
        candidates = [topic for topic in fitting if topic.type_name == kind]
        if len(candidates) == 1:
            return candidates[0]
        if candidates:
            raise DataError(f'expected one topic with {what}, got '
                            f'{", ".join(topic.name for topic in candidates)}; choose one with '
                            f'{option}', 'topics')
    if not required and not name:
        return None
    raise DataError(f'expected {what} on {name or "a topic"} of type {" or ".join(types)}, got '
                    f'none; name the topic with {option}', 'topics')
