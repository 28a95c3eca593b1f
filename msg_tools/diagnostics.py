"""A node's counters to and from DiagnosticArray."""

from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header


def diagnostics_to_msg(name: str, counts: Mapping[str, int], problem: str,
                       stamp: Time, failure: str = '') -> DiagnosticArray:
    """
    Return one node's counters as one status.

    `problem` is what was last found wrong and `failure` what the node does no more, each '' where
    nothing was: the level is then OK, else WARN or ERROR.
    """
    level = (DiagnosticStatus.ERROR if failure
             else DiagnosticStatus.WARN if problem else DiagnosticStatus.OK)
    status = DiagnosticStatus(
        level=level, name=name, message=failure or problem or 'ok',
        values=[KeyValue(key=key, value=str(counts[key])) for key in sorted(counts)])
    return DiagnosticArray(header=Header(stamp=stamp), status=[status])


def counts_from_msg(msg: DiagnosticArray, name: str) -> dict[str, int]:
    """Return the counters of the node of that name, empty where the message has none of it."""
    return {pair.key: int(pair.value)
            for status in msg.status if status.name == name for pair in status.values}
