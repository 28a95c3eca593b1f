"""Stamps to and from nanoseconds, by which messages are compared and joined."""

from builtin_interfaces.msg import Time

_NANOSECONDS = 1_000_000_000


def nanoseconds_from_stamp(stamp: Time) -> int:
    """Return the stamp as nanoseconds since the epoch."""
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)


def stamp_from_nanoseconds(nanoseconds: int) -> Time:
    """Return nanoseconds since the epoch as a stamp."""
    sec, nanosec = divmod(nanoseconds, _NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)
