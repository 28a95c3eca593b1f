"""Problems that the nodes of a loop report, for display."""

from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_from_msg

SHOWN_S = 5.0
"""Time for which a problem is shown after it was last published."""


class ProblemMonitor:
    """Keeps the problems on `/diagnostics` of the nodes in a namespace, without the observer's."""

    def __init__(self, observer: str) -> None:
        self._observer = observer
        self._problems: dict[str, tuple[str, float]] = {}

    def add(self, msg: DiagnosticArray, namespace: str, now: float) -> None:
        """Note a message; `now` in seconds of a steady clock."""
        for name, status in diagnostics_from_msg(msg).items():
            where, slash, node = name.rpartition('/')
            problem = status.failure or status.problem
            if problem and slash and (where or '/') == namespace and name != self._observer:
                self._problems[node] = problem, now

    def current(self, now: float) -> dict[str, str]:
        """Return the current problems, by the nodes' names."""
        self._problems = {node: (problem, at) for node, (problem, at) in self._problems.items()
                      if now - at < SHOWN_S}
        return {node: problem for node, (problem, _) in self._problems.items()}
