"""Serialized messages, as they are published and recorded."""

from typing import Any

from rclpy.serialization import serialize_message


def message_bytes(msg: Any) -> bytes:
    """Return a message's CDR bytes, header included."""
    return bytes(serialize_message(msg))


def type_name(msg: Any) -> str:
    """Return the name of a message's type, as in 'std_msgs/msg/Header'."""
    package, kind, _ = type(msg).__module__.split('.', 2)
    return f'{package}/{kind}/{type(msg).__name__}'
