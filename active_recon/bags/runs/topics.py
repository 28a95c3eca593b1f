"""The topics of the camera, its poses and the loop in a bag."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

from active_recon.bags.runs.parameters import nodes_called
from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.storage.bag import BagSummary
from active_recon.bags.storage.message_types import (
    JOINT_STATE,
    POSE,
    TRANSFORMS,
)
from active_recon.errors import ConfigError, DataError
from active_recon.parameters.reconstructor import ReconstructorParameters

POSE_TYPES = (POSE, TRANSFORMS)
"""Types of topics that have the camera's whole pose."""
IMAGE_ROLE, INFO_ROLE, POSE_ROLE = 'camera/image_raw', 'camera/camera_info', 'camera/pose'


@dataclass(frozen=True)
class Topics:
    """
    The topics with what a view needs; '' finds a topic by its name in the loop or by its type.

    Names may lack the first '/'.

    - image: sensor_msgs Image or CompressedImage; camera_info: sensor_msgs CameraInfo
    - azimuth: geometry_msgs PoseStamped of the camera; or tf2_msgs TFMessage that connect the
      images' frame with the object's, beside those of the topic with _static after its name; or
      radians, as a sensor_msgs JointState or a std_msgs Float64
    - depth: sensor_msgs Image or CompressedImage of a depth camera; '': depth is not used
    - joint: the joint's name, if the JointState has several
    - turned_object: the angle is a turntable's under a fixed camera, whose azimuth is its negative
    - object_frame: the frame of the PoseStamped, or that of the transforms that the object is in
    - camera_frame: the camera's optical frame among the transforms; '': the frame of the images
    - max_pose_gap: the longest time from an image to its neighbouring poses, s, as in the node
    """

    image: str = ''
    camera_info: str = ''
    azimuth: str = ''
    depth: str = ''
    joint: str = ''
    turned_object: bool = False
    object_frame: str = ReconstructorParameters.object_frame
    camera_frame: str = ''
    max_pose_gap: float = ReconstructorParameters.max_pose_gap

    def __post_init__(self) -> None:
        """Raise ConfigError on an invalid gap."""
        if not 0 <= self.max_pose_gap < math.inf:
            raise ConfigError('max_pose_gap: invalid time: expected 0 or more seconds, got '
                              f'{self.max_pose_gap}')

    def reject_redundant(self, azimuth: TopicSummary) -> None:
        """Raise ConfigError on options for another type than the poses or azimuths have."""
        unused = [option for option, given in (
            ('--joint', self.joint and azimuth.type_name != JOINT_STATE),
            ('--camera-frame', self.camera_frame and azimuth.type_name != TRANSFORMS),
            ('--turned-object', self.turned_object and azimuth.type_name in POSE_TYPES)) if given]
        if unused:
            raise ConfigError(f'{" and ".join(unused)}: not for {azimuth.type_name}, which the '
                              f'bag has on {azimuth.name}: leave it out, or name another topic '
                              'with --azimuth')


@dataclass(frozen=True)
class DepthTopics:
    """The topics of a depth camera; without camera info it has the image's lens."""

    images: TopicSummary
    camera_info: TopicSummary | None


@dataclass(frozen=True)
class CameraTopics:
    """
    The topics of the camera; `azimuth` has its poses, or only its azimuths.

    `static` has the static transforms beside those of `azimuth`. `of_views`: the camera's images
    were not recorded; `image` has what the network saw instead, one image for each view. `depth`
    is None unless it was asked for. `advice` is for where `azimuth` cannot be used.
    """

    image: TopicSummary
    camera_info: TopicSummary | None
    azimuth: TopicSummary
    static: TopicSummary | None = None
    of_views: bool = False
    depth: DepthTopics | None = None
    advice: str = ''


@dataclass(frozen=True)
class LoopTopics:
    """
    The loop's own topics: those in its namespace, '/' or '/robot/', unless they were remapped.

    `remapped` has full names by the names in the loop.
    """

    namespace: str
    remapped: Mapping[str, str]

    def full_name(self, name: str) -> str:
        """Return the full name that a topic of the loop has in the bag."""
        return self.remapped.get(name, f'{self.namespace}{name}')


def loop_topics(summary: BagSummary) -> LoopTopics | None:
    """Return the loop's topics in a bag; None: no view was taken."""
    present = {topic.name for topic in summary.topics if topic.count}
    remapped = {name: full for name, full in summary.provenance.items() if full in present}
    if 'view' in remapped:  # names are remapped from those in the namespace of the loop's nodes
        node = next(iter(nodes_called('reconstructor', summary.parameters)), remapped['view'])
        namespace = f'/{node.strip("/")}'.rpartition('/')[0]
        return LoopTopics(f'{namespace}/', remapped)
    namespaces = [topic.name.removesuffix('view') for topic in summary.topics
                  if topic.name.endswith('/view') and topic.type_name == POSE and topic.count]
    if len(namespaces) > 1:
        raise DataError(f'views of several loops, in {", ".join(namespaces)}: expected one loop '
                        'in a bag')
    return LoopTopics(namespaces[0], remapped) if namespaces else None
