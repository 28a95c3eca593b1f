"""Selects one transport of a camera's images: raw or compressed."""

TRANSPORT_TIMEOUT_S = 1.0
"""Silence of the selected transport after which the other one is used."""


class TransportSelector:
    """Selects the transport that arrives first; `selected` is '' until an image has arrived."""

    def __init__(self) -> None:
        self.selected = ''
        self._received_at = 0.0

    def accepts(self, transport: str, now: float) -> bool:
        """Return whether to use an image of a transport; `now` in seconds of a steady clock."""
        if (self.selected not in ('', transport)
                and now - self._received_at < TRANSPORT_TIMEOUT_S):
            return False
        self.selected, self._received_at = transport, now
        return True
