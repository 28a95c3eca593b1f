"""Deserialization of CDR messages by ROS's own definitions, never by those in a bag."""

from functools import cache
from pathlib import Path
from typing import Any

from active_recon.bags.storage.bag import RawMessage
from active_recon.errors import DataError
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

HEADER = 'std_msgs/msg/Header'
FLOAT = 'std_msgs/msg/Float64'
IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
JOINT_STATE = 'sensor_msgs/msg/JointState'
CLOUD = 'sensor_msgs/msg/PointCloud2'
POSE = 'geometry_msgs/msg/PoseStamped'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
TRANSFORMS = 'tf2_msgs/msg/TFMessage'
READ_TYPES = frozenset((HEADER, FLOAT, IMAGE, COMPRESSED_IMAGE, CAMERA_INFO, JOINT_STATE, CLOUD,
                        POSE, DIAGNOSTICS, TRANSFORMS))
_MAX_PADDING = 12
"""Trailing bytes that are accepted: ROS aligns the empty sequences of a JointState."""


@cache
def _standard() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def read_message(message: RawMessage) -> Any:
    """
    Return a message with the attributes of ROS's class and sequences of numbers as numpy arrays.

    Raises DataError if the bytes are not a message of its type.
    """
    data, store = message.data, _standard()
    try:
        if data[:2] not in (b'\0\0', b'\0\1') or len(data) < 4:
            raise ValueError('not encapsulated as CDR')
        kind = store.get_msgdef(message.type_name)
        read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
        content, end = read(data[4:], 0, kind.cls, store)
        if len(data) - 4 - end > _MAX_PADDING:
            raise ValueError(f'{len(data) - 4 - end} bytes left over')
        return content
    except Exception as error:  # the generated code raises all kinds of errors on damaged bytes
        raise DataError(
            f'{message.topic} at {message.received / 1e9:.3f} s: its {len(data)} bytes are no '
            f'{message.type_name} ({error})',
            'message_bytes') from error


@cache
def message_definition(type_name: str) -> str:
    """Return the definition of a type in the ros2msg form, with the types that it names."""
    definition, _ = _standard().generate_msgdef(type_name, ros_version=2)
    return definition


@cache
def require_standard(type_name: str, definition: bytes, path: Path) -> None:
    """
    Raise DataError if a bag defines a type otherwise than ROS does.

    Types that are never read may have any definition.
    """
    if type_name not in READ_TYPES:
        return
    try:
        types = get_types_from_msg(definition.decode(), type_name)
        theirs = {name: fields for name, (_, fields) in types.items()}
        ours = {name: _standard().fielddefs[name][1] for name in theirs}
    except Exception as error:  # the parser raises all kinds of errors on damaged text
        raise DataError(f'{path}: the definition of {type_name} cannot be parsed',
                        'definition') from error
    if theirs != ours:
        raise DataError(f'{path}: wrong definition of {type_name}: its fields differ from those '
                        'in ROS', 'definition')
