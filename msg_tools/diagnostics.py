"""What a node says of itself to and from DiagnosticArray: counters, facts, and what is wrong."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header


@dataclass(frozen=True)
class NodeStatus:
    """
    One node's state: its full name, and the machine it runs on as its `hardware_id`.

    `problem` is what was last found wrong and `failure` what the node does no more, each '' where
    nothing was: the level is then OK, else WARN or ERROR. The keys of counts begin in lower case,
    those of facts with a capital.
    """

    name: str
    counts: Mapping[str, int] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    problem: str = ''
    failure: str = ''
    hardware_id: str = ''


def diagnostics_to_msg(status: NodeStatus, stamp: Time) -> DiagnosticArray:
    """Return one node's state as one status, the facts before the counts."""
    level = (DiagnosticStatus.ERROR if status.failure
             else DiagnosticStatus.WARN if status.problem else DiagnosticStatus.OK)
    values = [KeyValue(key=key, value=str(pairs[key]))
              for pairs in (status.facts, status.counts) for key in sorted(pairs)]
    return DiagnosticArray(header=Header(stamp=stamp), status=[DiagnosticStatus(
        level=level, name=status.name, message=status.failure or status.problem or 'ok',
        hardware_id=status.hardware_id, values=values)])


def diagnostics_from_msg(msg: DiagnosticArray) -> dict[str, NodeStatus]:
    """
    Return the state of each node in the message, by its name.

    Of other programs' values those that are no whole numbers are facts, whatever their keys.
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
