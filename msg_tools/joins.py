"""Joining the messages of one view on their common stamp."""

from collections.abc import Sequence
from typing import Any

_KEPT = 16


class StampJoiner:
    """Collects the named parts of each stamp, in any order, until they are complete."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = frozenset(names)
        self._parts: dict[int, dict[str, Any]] = {}

    def clear(self) -> None:
        """Forget all incomplete parts."""
        self._parts.clear()

    def expect(self, name: str) -> None:
        """Expect another part of each stamp, of those that are incomplete, too."""
        self._names |= {name}

    def forget_before(self, stamp: int) -> None:
        """Forget the parts with earlier stamps."""
        self._parts = {each: parts for each, parts in self._parts.items() if each >= stamp}

    def add(self, name: str, stamp: int, part: Any) -> dict[str, Any] | None:
        """Add a part; return all parts of its stamp if they are now complete, else None."""
        parts = self._parts.setdefault(stamp, {})
        parts[name] = part
        if parts.keys() == self._names:
            return self._parts.pop(stamp)
        if len(self._parts) > _KEPT:  # parts may be lost on the way: what came first makes room
            del self._parts[next(iter(self._parts))]  # not the oldest: stamps may go back
        return None
