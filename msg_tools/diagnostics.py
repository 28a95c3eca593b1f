"""The status of a node to and from DiagnosticArray: counters, facts and problems."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header


@dataclass(frozen=True)
class NodeStatus:
    """
    The status of a node: its full name, and its machine as `hardware_id`.

    `problem` is the last warning and `failure` the last error, '' if there is none: the level is
    WARN, ERROR, or OK without either. Keys of counts begin in lower case, those of facts with a
    capital.
    """

    name: str
    counts: Mapping[str, int] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    problem: str = ''
    failure: str = ''
    hardware_id: str = ''


def diagnostics_to_msg(status: NodeStatus, stamp: Time) -> DiagnosticArray:
    """Return the status of one node, with the facts before the counts."""
    level = (DiagnosticStatus.ERROR if status.failure
             else DiagnosticStatus.WARN if status.problem else DiagnosticStatus.OK)
    values = [KeyValue(key=key, value=str(pairs[key]))
              for pairs in (status.facts, status.counts) for key in sorted(pairs)]
    return DiagnosticArray(header=Header(stamp=stamp), status=[DiagnosticStatus(
        level=level, name=status.name, message=status.failure or status.problem or 'ok',
        hardware_id=status.hardware_id, values=values)])


def diagnostics_from_msg(msg: DiagnosticArray) -> dict[str, NodeStatus]:
    """
    Return the status of each node in the message, by its name.

    Values of other programs that are not whole numbers are facts, whatever their keys.
    """
    states = {}
    for status in msg.status:
        values = {pair.key: pair.value for pair in status.values}
        counts = {key: int(value) for key, value in values.items() if _is_count(key, value)}
        facts = {key: value for key, value in values.items() if key not in counts}
        wrong = status.level != DiagnosticStatus.OK
        failed = wrong and status.level != DiagnosticStatus.WARN
        states[status.name] = NodeStatus(
            status.name, counts, facts, status.message if wrong and not failed else '',
            status.message if failed else '', status.hardware_id)
    return states


def _is_count(key: str, value: str) -> bool:
    return key[:1].islower() and value.isascii() and value.isdecimal()
