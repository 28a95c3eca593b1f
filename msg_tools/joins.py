"""Messages of one view, joined on their common stamp."""

from collections.abc import Sequence
from typing import Any

_KEPT = 16


class StampJoiner:
    """Collects named parts of one stamp, in any order, until all of them are there."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = frozenset(names)
        self._parts: dict[int, dict[str, Any]] = {}

    def clear(self) -> None:
        """Forget what is not complete."""
        self._parts.clear()

    def forget_before(self, stamp: int) -> None:
        """Forget what is stamped earlier."""
        self._parts = {each: parts for each, parts in self._parts.items() if each >= stamp}

    def add(self, name: str, stamp: int, part: Any) -> dict[str, Any] | None:
        """Take in one part; return all parts of its stamp if it was the last one missing."""
        parts = self._parts.setdefault(stamp, {})
        parts[name] = part
        if parts.keys() == self._names:
            return self._parts.pop(stamp)
        if len(self._parts) > _KEPT:  # what lost a part on the way makes room, the oldest first
            del self._parts[min(self._parts)]
        return None
