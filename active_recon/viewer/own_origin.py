"""The page is for this machine's browser alone, and not for what other pages run in it."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
import re

from websockets.asyncio import server

OWN_ORIGINS = (None, re.compile(r'https?://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?'))
"""Of pages that may connect: of this machine, also through a tunnel; None: no page at all."""


@contextmanager
def own_origins_only() -> Iterator[None]:
    """
    Let a websocket server that starts in this block refuse pages of other origins.

    viser accepts them all: any website that is open in the browser could read the camera's
    pictures and press the buttons.
    """
    serve = server.serve
    server.serve = partial(serve, origins=OWN_ORIGINS)  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
