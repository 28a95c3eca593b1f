"""rosbag2's description of a bag: what it holds, and the QoS its topics were offered with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

VERSION = 9  # of the description, as Jazzy writes it


@dataclass(frozen=True)
class QosProfile:
    """What a publisher offers, in rosbag2's words."""

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


def bag_information(file_name: str, topics: Sequence[Topic], counts: Mapping[str, int],
                    begin: int, end: int) -> dict[str, Any]:
    """
    Return what metadata.yaml says of a bag of one MCAP file.

    `counts` holds the messages of each topic; `begin` and `end` are the receive times of the
    first and the last message, nanoseconds since 1970.
    """
    def span() -> dict[str, Any]:
        return {'starting_time': {'nanoseconds_since_epoch': begin},
                'duration': {'nanoseconds': end - begin},
                'message_count': sum(counts.values())}

    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        **span(),
        'topics_with_message_count': [{
            'topic_metadata': {
                'name': topic.name,
                'type': topic.type_name,
                'serialization_format': 'cdr',
                'offered_qos_profiles': _offered(topic.qos),
                'type_description_hash': '',
            },
            'message_count': counts.get(topic.name, 0),
        } for topic in topics],
        'compression_format': '',  # of rosbag2 itself: MCAP compresses its own chunks
        'compression_mode': '',
        'relative_file_paths': [file_name],
        'files': [{'path': file_name, **span()}],
        'custom_data': None,
        'ros_distro': 'jazzy',
    }


def metadata_yaml(information: dict[str, Any]) -> str:
    """Return the text of the file metadata.yaml."""
    return as_yaml({'rosbag2_bagfile_information': information})


def offered_qos_yaml(qos: Sequence[QosProfile]) -> str:
    """Return the profiles as the channel of a topic carries them."""
    return as_yaml(_offered(qos)) if qos else ''


def as_yaml(value: object) -> str:
    """Return the value as YAML, its keys in their order."""
    return str(yaml.safe_dump(value, sort_keys=False))


def _offered(qos: Sequence[QosProfile]) -> list[dict[str, Any]]:
    # A publisher's history and depth are not told to others, so they are unknown here.
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
    """Return a new mapping each time: one met twice is written as an anchor that few expect."""
    return {'sec': 9223372036, 'nsec': 854775807}
