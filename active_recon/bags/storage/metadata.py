"""rosbag2's metadata.yaml: the content of a bag and the offered QoS of its topics."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from active_recon.errors import DataError
from active_recon.yaml_text import yaml_value
import yaml

VERSION = 9  # of metadata.yaml in Jazzy
RELIABILITIES = ('reliable', 'best_effort')
DURABILITIES = ('volatile', 'transient_local')
_RELIABILITY: Mapping[object, str] = {
    **{word: word for word in RELIABILITIES}, 1: 'reliable', 2: 'best_effort'}
_DURABILITY: Mapping[object, str] = {
    **{word: word for word in DURABILITIES}, 1: 'transient_local', 2: 'volatile'}
PROVENANCE = 'active_recon'
"""The MCAP metadata record with the versions, weights and policy that made a bag; the last one in
a file is valid."""


@dataclass(frozen=True)
class QosProfile:
    """The QoS that a publisher offers, in rosbag2's terms."""

    reliability: str = 'reliable'
    """'reliable' or 'best_effort'."""
    durability: str = 'volatile'
    """'volatile' or 'transient_local'."""


@dataclass(frozen=True)
class Topic:
    """A recorded topic: its full name, its type as in 'std_msgs/msg/Header', its profiles."""

    name: str
    type_name: str
    qos: tuple[QosProfile, ...] = ()

    @property
    def latched(self) -> bool:
        """Whether late subscribers receive the last message."""
        return bool(self.qos) and all(
            profile.durability == 'transient_local' for profile in self.qos)


@dataclass
class Contents:
    """
    How many messages each topic has, and the span of their receive times, nanoseconds.

    `late` is the longest time that a message was received before one that lies ahead of it.
    """

    counts: Counter[str] = field(default_factory=Counter)
    begin: int = 0
    end: int = 0
    late: int = 0

    def add(self, topic: str, time: int) -> None:
        """Count one message."""
        self.begin = min(self.begin, time) if self.counts else time
        self.end = max(self.end, time)
        self.late = max(self.late, self.end - time)
        self.counts[topic] += 1

    def copy(self) -> 'Contents':
        """Return an independent copy."""
        return Contents(self.counts.copy(), self.begin, self.end, self.late)


def total(parts: Iterable[Contents]) -> Contents:
    """Return the sum of the contents of several files, in their order."""
    whole = Contents()
    for part in parts:
        if not whole.counts:
            whole = part.copy()
        elif part.counts:
            late = max(whole.late, part.late, whole.end - part.begin)
            whole = Contents(whole.counts + part.counts, min(whole.begin, part.begin),
                             max(whole.end, part.end), late)
    return whole


def bag_information(files: Sequence[tuple[str, Contents]],
                    topics: Iterable[Topic]) -> dict[str, Any]:
    """Return the content of metadata.yaml for a bag of MCAP files, given by name and in order."""
    whole = total(contents for _, contents in files)
    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        **_span(whole),
        'topics_with_message_count': [{
            'topic_metadata': {
                'name': topic.name,
                'type': topic.type_name,
                'serialization_format': 'cdr',
                'offered_qos_profiles': _offered(topic.qos),
                'type_description_hash': '',
            },
            'message_count': whole.counts[topic.name],
        } for topic in topics],
        'compression_format': '',  # of rosbag2 itself: MCAP compresses its own chunks
        'compression_mode': '',
        'relative_file_paths': [name for name, _ in files],
        'files': [{'path': name, **_span(contents)} for name, contents in files],
        'custom_data': None,
        'ros_distro': 'jazzy',
    }


def parameters_name(node: str) -> str:
    """Return the name of the attachment with the parameters of a node, given its full name."""
    return f'parameters/{node.strip("/")}.yaml'


def parameters_node(name: str) -> str:
    """Return the node whose parameters are in an attachment of that name; '' for others."""
    if name.startswith('parameters/') and name.endswith('.yaml'):
        return name.removeprefix('parameters/').removesuffix('.yaml')
    return ''


def metadata_yaml(information: dict[str, Any]) -> str:
    """Return the text of metadata.yaml."""
    return as_yaml({'rosbag2_bagfile_information': information})


def offered_qos_yaml(qos: Sequence[QosProfile]) -> str:
    """Return the profiles as the metadata of an MCAP channel has them."""
    return as_yaml(_offered(qos)) if qos else ''


def as_yaml(value: object) -> str:
    """Return the value as YAML, with its keys in their order."""
    return str(yaml.safe_dump(value, sort_keys=False))


def yaml_mapping(text: bytes, name: str) -> dict[str, Any]:
    """Return the mapping in a YAML text; raises DataError with the name if it is none."""
    try:
        value = yaml_value(text)
    except ValueError as error:
        raise DataError(f'{name}: invalid YAML: {error}') from error
    if not isinstance(value, dict):
        raise DataError(f'{name}: invalid content: expected a mapping, got a '
                        f'{type(value).__name__}')
    return value


@lru_cache(maxsize=256)  # a bag is read several times, and most channels say the same
def qos_from_yaml(text: str) -> tuple[QosProfile, ...]:
    """
    Return the profiles in the metadata of an MCAP channel; unknown ones are left out.

    Before Jazzy the policies were the numbers of the middleware's enumerations.
    """
    try:
        offered = yaml_value(text) or []
        named = [(_RELIABILITY.get(profile['reliability']), _DURABILITY.get(profile['durability']))
                 for profile in offered]
    except (TypeError, KeyError, ValueError):
        return ()
    return tuple(QosProfile(reliability, durability) for reliability, durability in named
                 if reliability and durability)


def _span(contents: Contents) -> dict[str, Any]:
    return {'starting_time': {'nanoseconds_since_epoch': contents.begin},
            'duration': {'nanoseconds': contents.end - contents.begin},
            'message_count': contents.counts.total()}


def _offered(qos: Sequence[QosProfile]) -> list[dict[str, Any]]:
    # Discovery does not share a publisher's history and depth, so they are unknown here.
    return [{
        'history': 'unknown',
        'depth': 0,
        'reliability': profile.reliability,
        'durability': profile.durability,
        'deadline': _forever(),
        'lifespan': _forever(),
        'liveliness': 'automatic',
        'liveliness_lease_duration': _forever(),
        'avoid_ros_namespace_conventions': False,
    } for profile in qos]


def _forever() -> dict[str, int]:
    """Return a new mapping each time: YAML writes a shared one as an anchor, which few expect."""
    return {'sec': 9223372036, 'nsec': 854775807}
