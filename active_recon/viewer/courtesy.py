"""When the page stands still, so that the loop has the cores for the image that is on its way."""

import math

GIVE_WAY_S = 0.015
"""About what a view costs from image to goal; an image that is no view is never answered."""


class Courtesy:
    """
    Knows from what is heard whether an image is on its way; times are of any clock, seconds.

    Between two waits the page has its turn, however many images come.
    """

    def __init__(self) -> None:
        self._wait_until = -math.inf
        self._had_turn = True

    def image(self, now: float) -> None:
        """Note an image, which the loop may now work on."""
        if self._had_turn:
            self._had_turn = False
            self._wait_until = now + GIVE_WAY_S

    def answer(self) -> None:
        """Note what the loop says last of a view: where to look next, or that it is done."""
        self._wait_until = -math.inf

    def has_turn(self, now: float) -> bool:
        """Return whether the page may draw now, which it is then taken to do."""
        self._had_turn = now >= self._wait_until
        return self._had_turn
