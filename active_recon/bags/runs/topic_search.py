"""Finding the topics of the camera and its poses in a bag."""

from collections.abc import Sequence

from active_recon.bags.runs.image_kinds import non_camera_topics
from active_recon.bags.runs.recorded_transforms import connecting, STATIC
from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.runs.topics import (
    CameraTopics,
    DepthTopics,
    IMAGE_ROLE,
    INFO_ROLE,
    POSE_ROLE,
    Topics,
)
from active_recon.bags.storage.bag import Bag, BagSummary
from active_recon.bags.storage.message_types import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    FLOAT,
    IMAGE,
    JOINT_STATE,
    POSE,
    read_message,
    TRANSFORMS,
)
from active_recon.errors import DataError

IMAGE_TYPES = (IMAGE, COMPRESSED_IMAGE)
AZIMUTH_TYPES = (POSE, TRANSFORMS, JOINT_STATE, FLOAT)
_ROLES = (IMAGE_ROLE, INFO_ROLE, POSE_ROLE)
_OF_THE_LOOP = ('/view', '/view_image', '/latent', '/camera/mask', '/next_view', '/next_azimuth',
                '/entropy')


def camera_topics(bag: Bag, summary: BagSummary, topics: Topics) -> CameraTopics:
    """
    Return the camera's topics; raises DataError that names all missing or ambiguous ones.

    A topic is found by its option, else by its remapped name, which the recorder stores, else by
    its name in the loop, else by its type and its first message. Topics that the nodes subscribed
    to under another role are left out.
    """
    if not any(topic.count for topic in summary.topics):
        raise DataError('no messages: the bag is empty', 'empty')
    search = _Search(bag, summary)
    missing = []
    try:
        image, of_views = search.image(topics.image)
    except DataError as error:
        missing.append(error)
    try:
        azimuth = search.azimuth(topics, None if missing else image,
                                 loops_own=not missing and of_views)
    except DataError as error:
        missing.append(error)
    if missing:
        raise DataError('; '.join(map(str, missing)), 'topics')
    return CameraTopics(image, search.camera_info(topics.camera_info, image), azimuth,
                        search.static_beside(azimuth), of_views,
                        search.depth(topics.depth) if topics.depth else None, search.advice)


class _Search:
    """Finds the topics in one bag."""

    def __init__(self, bag: Bag, summary: BagSummary) -> None:
        self._bag = bag
        self.advice = ''
        self._recorded_as = summary.provenance
        others = {full for name, full in summary.provenance.items()
                  if name.partition('/compressed')[0] not in _ROLES}
        self._present = [topic for topic in summary.topics
                         if topic.count and topic.name not in others]

    def image(self, name: str) -> tuple[TopicSummary, bool]:
        """Return the topic of the images, and whether they are what the network saw."""
        fitting = self._fitting(name, IMAGE_TYPES)
        usual = self._known_by_name(name, fitting, IMAGE_ROLE)
        # Messages are read only if the names are not enough
        others = {} if usual else non_camera_topics(self._bag, fitting)
        cameras = usual or [topic for topic in fitting if topic.name not in others]
        # The compressed form of images that are there raw is no other camera's
        raw = {topic.name for topic in cameras if topic.type_name == IMAGE}
        cameras = [topic for topic in cameras if topic.type_name == IMAGE
                   or topic.name.removesuffix('/compressed') not in raw]
        if cameras:
            return _only(cameras, (IMAGE_TYPES,), "a camera's images", '--image'), False
        seen = [topic for topic in self._present
                if topic.name.endswith('/view_image') and topic.type_name == IMAGE]
        if len(seen) == 1 and not name:
            return seen[0], True
        instead = f' ({", ".join(f"{topic} has {what}" for topic, what in others.items())})'
        raise DataError(
            f'no camera images on {name or "any topic"}{instead if others else ""}: expected '
            f'{" or ".join(IMAGE_TYPES)}; name the topic with --image', 'topics')

    def azimuth(self, asked: Topics, image: TopicSummary | None, loops_own: bool) -> TopicSummary:
        """Return the topic of the poses or azimuths; `loops_own`: that of the views only."""
        name = asked.azimuth
        views = [topic for topic in self._present
                 if topic.name.endswith('/view') and topic.type_name == POSE]
        fitting = self._fitting(name, AZIMUTH_TYPES)
        found = (views if loops_own and not name else None) or self._known_by_name(
            name, fitting, POSE_ROLE)
        if not found and any(topic.type_name == TRANSFORMS for topic in fitting):
            fitting = self._connected(fitting, asked, image)
        found = found or fitting or views
        if not found or name and not fitting:
            raise DataError(f"no camera poses or azimuths on {name or 'any topic'}: expected "
                            f'{" or ".join(AZIMUTH_TYPES)}; name the topic with --azimuth'
                            f'{self.advice}', 'topics')
        return _only(found, AZIMUTH_TYPES, "the camera's poses or azimuths", '--azimuth',
                     self.advice)

    def static_beside(self, azimuth: TopicSummary) -> TopicSummary | None:
        """Return the topic of the static transforms beside others, None if there is none."""
        statics = [topic for topic in self._present
                   if topic.type_name == azimuth.type_name == TRANSFORMS
                   and topic.name.endswith(STATIC) and topic.name != azimuth.name]
        return next((topic for topic in statics if topic.name == azimuth.name + STATIC),
                    statics[0] if len(statics) == 1 else None)

    def _connected(self, fitting: Sequence[TopicSummary], asked: Topics,
                   image: TopicSummary | None) -> list[TopicSummary]:
        """
        Return the topics whose transforms connect the camera's frame with the object's.

        Where there are none, those that are no transforms, and `advice` tells what the transforms
        lack.
        """
        transforms = [topic for topic in fitting if topic.type_name == TRANSFORMS]
        wanted = [asked.object_frame.lstrip('/')]
        if asked.camera_frame:
            wanted.append(asked.camera_frame.lstrip('/'))
        elif image:
            first = next(iter(self._bag.messages({image.name})))
            wanted.append(read_message(first).header.frame_id.lstrip('/'))
        found, frames = connecting(self._bag, transforms, wanted)
        lacking = [repr(frame) for frame in wanted if frame not in frames]
        if not found and frames:
            what = (f'have no frame {" and no ".join(lacking)}' if lacking
                    else f'do not connect {" and ".join(map(repr, wanted))}')
            self.advice = (f'. The transforms {what}; there are {", ".join(sorted(frames))}: name '
                           "the object's with --object-frame, and with --object-position where "
                           "the object is in it; --camera-frame, if the images' is wrong")
        return found or [topic for topic in fitting if topic.type_name != TRANSFORMS]

    def camera_info(self, name: str, image: TopicSummary) -> TopicSummary | None:
        """Return the topic of the camera info, None if there is none."""
        fitting = self._fitting(name, (CAMERA_INFO,))
        usual, beside = self._known_by_name(name, fitting, INFO_ROLE), self._info_beside(image)
        # Of a camera that was not a loop's, the name does not tell whose camera info it is
        of_loop = name or IMAGE_ROLE in self._recorded_as or INFO_ROLE in self._recorded_as
        found = (usual or beside if of_loop else beside or usual) or fitting
        if not found and name:
            raise DataError(f'no camera info on {name}: expected {CAMERA_INFO}; name the topic '
                            'with --camera-info', 'topics')
        return _only(found, (CAMERA_INFO,), 'camera info', '--camera-info') if found else None

    def depth(self, name: str) -> DepthTopics:
        """Return the topics of a depth camera; raises DataError where there are no images."""
        for images in self._fitting(name, IMAGE_TYPES):
            info = self._info_beside(images)
            return DepthTopics(images, info[0] if info else None)
        raise DataError(f'no depth images on {name}: expected {" or ".join(IMAGE_TYPES)}; name '
                        'the topic with --depth', 'topics')

    def _info_beside(self, image: TopicSummary) -> list[TopicSummary]:
        """Return the camera info in the namespace of images, raw or compressed."""
        raw = image.name.removesuffix('/compressed').removesuffix('/compressedDepth')
        return [topic for topic in self._fitting('', (CAMERA_INFO,))
                if topic.name == f'{raw.rpartition("/")[0]}/camera_info']

    def _fitting(self, name: str, types: Sequence[str]) -> list[TopicSummary]:
        """Return the topics of the types with that name, or all but the loop's own."""
        return [topic for topic in self._present if topic.type_name in types and (
            topic.name.lstrip('/') == name.lstrip('/') if name
            else not topic.name.endswith(_OF_THE_LOOP))]

    def _known_by_name(self, name: str, fitting: Sequence[TopicSummary],
                       usual: str) -> list[TopicSummary]:
        """Return the topics found by an option, by the recorded name, or by the usual name."""
        if name:
            return list(fitting)
        remapped = self._recorded_as.get(usual, '')
        return ([topic for topic in fitting if remapped in (topic.name, topic.name.removesuffix(
            '/compressed'))] or [topic for topic in fitting if topic.name.endswith(f'/{usual}')])


def _only(topics: Sequence[TopicSummary], types: Sequence[str | Sequence[str]], what: str,
          option: str, advice: str = '') -> TopicSummary:
    """Return the topic of the first type, or types, present: they are in order of preference."""
    for kind in types:
        alike = (kind,) if isinstance(kind, str) else kind
        candidates = [topic for topic in topics if topic.type_name in alike]
        if len(candidates) == 1:
            return candidates[0]
        if candidates:
            raise DataError(f'{what} on several topics, '
                            f'{", ".join(topic.name for topic in candidates)}: choose one with '
                            f'{option}{advice}', 'topics')
    raise AssertionError('topics were chosen by their types')
