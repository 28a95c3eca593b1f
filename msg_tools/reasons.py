"""The reason for a goal to and from a DiagnosticArray with the stamp of the goal."""

import math

from active_recon.errors import MessageError
from active_recon.policies.reasons import GoalReason
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

NAME = 'goal_reason'
_GAIN = 'expected_gain'


def goal_reason_to_msg(reason: GoalReason, header: Header) -> DiagnosticArray:
    """Return one status: its message in words, and the gain as its value, empty if not known."""
    gain = '' if reason.gain is None else str(reason.gain)
    return DiagnosticArray(header=header, status=[DiagnosticStatus(
        level=DiagnosticStatus.OK, name=NAME, message=reason.shows, hardware_id='',
        values=[KeyValue(key=_GAIN, value=gain)])])


def goal_reason_from_msg(msg: DiagnosticArray) -> GoalReason:
    """
    Return the reason, bit by bit as it was sent.

    Raises MessageError where there is none, or where its gain is not finite.
    """
    told = next((status for status in msg.status if status.name == NAME), None)
    if told is None:
        raise MessageError(f'no reason: expected a status of the name {NAME}, got '
                           f'{", ".join(status.name for status in msg.status) or "none"}', NAME)
    gain = next((pair.value for pair in told.values if pair.key == _GAIN), '')
    return GoalReason(told.message, _number(gain) if gain else None)


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MessageError(f'invalid reason: expected a finite {_GAIN}, got {text!r}', NAME)
    return value
