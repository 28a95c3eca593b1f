"""What the nodes of a loop say is wrong, for a person who watches it."""

from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_from_msg

SHOWN_S = 5.0
"""For so long a warning is shown; one that lasts is told again every second."""


class HeardProblems:
    """Keeps what `/diagnostics` tells of the nodes in one namespace, but of the watcher itself."""

    def __init__(self, watcher: str) -> None:
        self._watcher = watcher
        self._said: dict[str, tuple[str, float]] = {}

    def hear(self, msg: DiagnosticArray, namespace: str, now: float) -> None:
        """Note a message; `now` in seconds of a steady clock."""
        for name, status in diagnostics_from_msg(msg).items():
            where, slash, node = name.rpartition('/')
            said = status.failure or status.problem
            if said and slash and (where or '/') == namespace and name != self._watcher:
                self._said[node] = said, now

    def now(self, now: float) -> dict[str, str]:
        """Return what is wrong, by the nodes' names."""
        self._said = {node: (said, at) for node, (said, at) in self._said.items()
                      if now - at < SHOWN_S}
        return {node: said for node, (said, _) in self._said.items()}
