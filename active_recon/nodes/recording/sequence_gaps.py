"""Messages that were published and not heard, by the numbers that their publisher gives them."""

from collections.abc import Set


class SequenceGaps:
    """
    Finds gaps in each topic's numbers, from the first message that was heard.

    Each publisher counts for itself: with two of them on a topic the gaps say nothing.
    """

    def __init__(self) -> None:
        self._publishers: dict[str, Set[bytes]] = {}
        self._last: dict[str, int] = {}

    def published_by(self, topic: str, publishers: Set[bytes]) -> None:
        """Be told who publishes now, by what tells publishers apart."""
        if self._publishers.get(topic) != publishers:
            self._publishers[topic] = publishers
            self._last.pop(topic, None)

    def listened_anew(self, topic: str) -> None:
        """Expect no number: what came meanwhile was not listened to, or is heard again."""
        self._last.pop(topic, None)

    def before(self, topic: str, number: int) -> int:
        """Return how many messages are missing before that of a number."""
        last = self._last.get(topic)
        if len(self._publishers.get(topic, ())) != 1:
            return 0
        self._last[topic] = number
        return max(number - last - 1, 0) if last is not None else 0
