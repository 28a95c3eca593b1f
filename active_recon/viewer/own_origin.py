"""The page is for this machine's browser alone, and not for what other pages run in it."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
import re

from websockets.asyncio import server
from websockets.http11 import Request, Response

OWN_ORIGINS = (None, re.compile(r'https?://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?'))
"""Of pages that may connect: of this machine, also through a tunnel; None: no page at all."""
_FRAMES = ('frame-ancestors http://127.0.0.1:* https://127.0.0.1:* http://localhost:* '
           'https://localhost:*')


def _unframed(connection: server.ServerConnection, request: Request, response: Response) -> None:
    """Let no website show the page in a frame, where a reader may press its buttons unawares."""
    response.headers['Content-Security-Policy'] = _FRAMES


@contextmanager
def own_origins_only() -> Iterator[None]:
    """
    Let a websocket server that starts in this block refuse pages of other origins, and frames.

    viser accepts them all: any website that is open in the browser could read the camera's
    pictures and press the buttons.
    """
    serve = server.serve
    server.serve = partial(  # type: ignore[assignment, misc]
        serve, origins=OWN_ORIGINS, process_response=_unframed)
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
