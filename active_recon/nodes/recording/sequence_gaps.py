"""Messages that were published and not received, found by gaps in sequence numbers."""

from collections.abc import Set


class SequenceGaps:
    """
    Finds gaps in the sequence numbers of each topic, from the first message received.

    Each publisher numbers its own messages: with two of them on a topic, gaps mean nothing.
    """

    def __init__(self) -> None:
        self._publishers: dict[str, Set[bytes]] = {}
        self._last: dict[str, int] = {}

    def set_publishers(self, topic: str, publishers: Set[bytes]) -> None:
        """Set the ids of a topic's current publishers."""
        if self._publishers.get(topic) != publishers:
            self._publishers[topic] = publishers
            self._last.pop(topic, None)

    def restart(self, topic: str) -> None:
        """Expect any number next: the topic was subscribed again."""
        self._last.pop(topic, None)

    def before(self, topic: str, number: int) -> int:
        """Return how many messages are missing before that with this number."""
        last = self._last.get(topic)
        if len(self._publishers.get(topic, ())) != 1:
            return 0
        self._last[topic] = number
        return max(number - last - 1, 0) if last is not None else 0
