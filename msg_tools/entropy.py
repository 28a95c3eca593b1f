"""The entropy of a reconstruction to and from a message with the stamp of its view."""

import math

from active_recon.errors import MessageError
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

NAME = 'entropy'


def entropy_from_msg(msg: JointState) -> float:
    """
    Return the entropy in nats.

    Raises MessageError unless there is exactly one position, and it is finite.
    """
    if len(msg.position) != 1:
        raise MessageError(f'invalid entropy: expected one position, got {len(msg.position)}',
                           'entropy')
    entropy = float(msg.position[0])
    if not math.isfinite(entropy):
        raise MessageError(f'entropy not finite: got {entropy}', 'entropy')
    return entropy


def entropy_to_msg(entropy: float, header: Header) -> JointState:
    """Return an entropy in nats as the position of one joint: standard, stamped, and plotted."""
    # Some readers outside ROS fail on empty sequences, so none is left empty
    return JointState(header=header, name=[NAME], position=[entropy], velocity=[0.0],
                      effort=[0.0])
