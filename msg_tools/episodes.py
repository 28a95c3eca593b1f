"""Episodes and their ends to and from std_msgs/Header."""

from dataclasses import dataclass

from active_recon.errors import MessageError
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from std_msgs.msg import Header


@dataclass(frozen=True)
class Episode:
    """One object's views: a unique id, and when it begins, nanoseconds since the epoch."""

    id: str
    begin: int


def episode_from_msg(msg: Header) -> Episode:
    """Return the episode; raises MessageError if it has no id."""
    if not msg.frame_id:
        raise MessageError('episode without an id: expected a unique id as its frame_id',
                           'episode')
    return Episode(msg.frame_id, nanoseconds_from_stamp(msg.stamp))


def episode_to_msg(episode: Episode) -> Header:
    """Return the episode as a header: its begin the stamp, its id the frame_id."""
    return Header(stamp=stamp_from_nanoseconds(episode.begin), frame_id=episode.id)


def done_from_msg(msg: Header) -> tuple[int, str]:
    """Return the stamp of the deciding view, nanoseconds, and the reason, '' if not done."""
    return nanoseconds_from_stamp(msg.stamp), msg.frame_id


def done_to_msg(stamp: int, reason: str) -> Header:
    """Return the end of an episode: the deciding view's stamp, nanoseconds, and the reason."""
    return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=reason)
