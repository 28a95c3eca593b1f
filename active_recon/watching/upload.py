"""
The server of the upload page: it puts photos of a phone into the watched folder.

It answers only below a random word that is new in every run, and only clients of the same machine
or network. What a client sends is never a path, and only whole JPEG and PNG files are kept.
"""

import base64
from collections.abc import Callable
import hmac
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
import io
import ipaddress
import json
from pathlib import Path
import secrets
import socket
from socketserver import TCPServer
import threading
from typing import Any

from active_recon.errors import ConfigError, DataError
from active_recon.photos.formats import is_heic, JPEG_ADVICE
from active_recon.photos.large_images import opened
from active_recon.viewer.address import HOST
from active_recon.watching.upload_page import PAGE
from active_recon.watching.watcher import Progress, Verdicts
from active_recon.whole_files import whole_file
import cv2

LARGEST_UPLOAD = 30_000_000
"""Bytes of a photo."""
_ONE_AT_A_TIME = threading.Lock()  # of photos that are looked at: one may take a gigabyte
_SUFFIXES = {'JPEG': '.jpg', 'PNG': '.png'}
_MOST_PIXELS = 200_000_000
_READ_SIDE = 1024
_AT_ONCE = 4
_MOST_CONNECTIONS = 64  # also of those without the random word: each takes a thread and a file
_ANSWER_S = 60.0
_LOOK_S = 0.1  # how often it is looked whether to stop
_IDLE_S = 30.0  # after which a client that sends nothing is left
_CHUNK = 1 << 16


class UploadServer(ThreadingHTTPServer):
    """
    A page on which photos are uploaded, in a thread of its own; `url` is its address.

    `folder` gets the photos, under names of the server's own. `progress` is asked for what is
    known, `verdicts` for what became of a photo; `skip` asks for another place, and waits for it
    at most so many seconds. `host` is an address of this machine; port 0: any. Raises ConfigError
    where it cannot be served there.
    """

    daemon_threads = True

    def __init__(self, folder: Path, progress: Callable[[], Progress], verdicts: Verdicts,
                 host: str = HOST, port: int = 0,
                 skip: Callable[[float], None] = lambda seconds: None) -> None:
        try:
            super().__init__((host, port), _Handler)
        except OSError as error:
            raise ConfigError(f'upload page: cannot be served at {host}:{port}: '
                              f'{error.strerror}') from error
        self.token = secrets.token_urlsafe(16)
        self.url = f'http://{host}:{self.server_address[1]}/{self.token}/'
        self.progress, self.verdicts, self.skip = progress, verdicts, skip
        self.open_uploads = threading.BoundedSemaphore(_AT_ONCE)
        self._connections = threading.BoundedSemaphore(_MOST_CONNECTIONS)
        self._folder = folder
        self._naming = threading.Lock()
        self._last_number = 0
        threading.Thread(target=self.serve_forever, args=(_LOOK_S,), daemon=True).start()

    def server_bind(self) -> None:
        """Take the address, without asking the network for its name: it may not answer."""
        TCPServer.server_bind(self)

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Return whether a client is on this machine or in a private network."""
        return ipaddress.ip_address(client_address[0]).is_private

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a client in a thread of its own; leave it where there are too many."""
        if self._connections.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a client, and make room for another."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Let a client go whose connection broke."""

    def keep(self, photo: bytes, suffix: str) -> str:
        """Write a photo under a new name, whole or not at all; return the name."""
        with self._naming:
            number = self._last_number + 1  # also after one was deleted: its verdict is known
            while any((self._folder / f'phone-{number:04}{each}').exists()
                      for each in _SUFFIXES.values()):
                number += 1
            self._last_number = number
            name = f'phone-{number:04}{suffix}'
            with whole_file(self._folder / name) as begun:
                begun.write_bytes(photo)
        return name

    def close(self) -> None:
        """Stop serving."""
        self.shutdown()
        self.server_close()


def lan_address() -> str:
    """Return this machine's address in the local network; raises ConfigError without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(('10.255.255.255', 9))  # sends nothing, but chooses an interface
            found = str(probe.getsockname()[0])
        except OSError:
            found = HOST
    address = ipaddress.ip_address(found)
    if address.is_loopback or not address.is_private:
        raise ConfigError(f'--lan: no local network: expected a private address, got {found}')
    return found


def refusal(photo: bytes) -> str:
    """Return why bytes are no photo that can be used, in one line; '' where they are one."""
    if is_heic(photo[:64]):
        return f'HEIC photos cannot be read here: {JPEG_ADVICE}'
    return '' if _format(photo) else ('not a photo: expected JPEG or PNG, whole and of at most '
                                      f'{_MOST_PIXELS / 1e6:.0f} megapixels')


def _format(photo: bytes) -> str:
    """Return the format by the content, '' where it is none of those allowed, or cut off."""
    try:
        with _ONE_AT_A_TIME, opened(io.BytesIO(photo), _MOST_PIXELS, tuple(_SUFFIXES)) as image:
            kind = str(image.format)
            if kind == 'PNG':
                image.verify()  # by its checksums
            else:
                image.draft('RGB', (_READ_SIDE, _READ_SIDE))  # at a fraction of its size
                image.load()
            return 'JPEG' if kind == 'MPO' else kind  # with a second image for HDR or depth
    except DataError:
        return ''


class _Handler(BaseHTTPRequestHandler):
    """One connection."""

    server: UploadServer
    server_version, sys_version = 'active_recon', ''
    timeout = _IDLE_S

    def do_GET(self) -> None:
        """Answer with the page, or with what is known."""
        place = self._place()
        if place == '':
            nonce = secrets.token_urlsafe(12)
            self._answer(HTTPStatus.OK, PAGE.replace('NONCE', nonce)
                         .replace('LARGEST', str(LARGEST_UPLOAD)).encode(), 'text/html', nonce)
        elif place == 'state':
            self._tell(HTTPStatus.OK, _known(self.server.progress()))
        else:
            self._tell(HTTPStatus.NOT_FOUND, {'verdict': 'nothing here'})

    def do_POST(self) -> None:
        """Take a photo in, or skip a place; answer with what became of it and where to stand."""
        self.close_connection = True
        place = self._place()
        if place == 'skip':
            self.server.skip(_ANSWER_S)
            self._tell(HTTPStatus.OK, _known(self.server.progress()))
            return
        if place != 'photo':
            self._tell(HTTPStatus.NOT_FOUND, {'verdict': 'nothing here'})
            return
        length = self.headers.get('Content-Length', '')
        if not length.isascii() or not length.isdigit():
            self._tell(HTTPStatus.LENGTH_REQUIRED, {'verdict': 'Refused: no length given'})
            return
        length = length.lstrip('0') or '0'
        if len(length) > 20 or int(length) > LARGEST_UPLOAD:
            self._tell(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {'verdict':
                       f'Refused: expected at most {LARGEST_UPLOAD / 1e6:.0f} MB'})
            return
        if not self.server.open_uploads.acquire(blocking=False):
            self._skip(int(length))  # who sends it all before the answer would not hear it
            self._tell(HTTPStatus.SERVICE_UNAVAILABLE,
                       {'verdict': 'Busy with other photos: try again'})
            return
        try:
            self._take(self._read(int(length)), int(length))
        finally:
            self.server.open_uploads.release()

    def _read(self, length: int) -> bytes:
        """Return up to so many bytes, fewer where the client ends before."""
        parts = []
        while length and (part := self.rfile.read(min(length, _CHUNK))):
            parts.append(part)
            length -= len(part)
        return b''.join(parts)

    def _skip(self, length: int) -> None:
        """Read up to so many bytes away."""
        while length and (part := self.rfile.read(min(length, _CHUNK))):
            length -= len(part)

    def _take(self, photo: bytes, length: int) -> None:
        if len(photo) < length:
            self._tell(HTTPStatus.BAD_REQUEST, {'verdict': 'Refused: the photo is not whole'})
            return
        kind = _format(photo)
        if not kind:
            self._tell(HTTPStatus.UNSUPPORTED_MEDIA_TYPE,
                       {'verdict': f'Refused: {refusal(photo)}'})
            return
        try:
            name = self.server.keep(photo, _SUFFIXES[kind])
        except OSError as error:
            self._tell(HTTPStatus.INSUFFICIENT_STORAGE,
                       {'verdict': f'Not kept: {error.strerror}'})
            return
        left_out = self.server.verdicts.wait(name, _ANSWER_S)
        verdict = ('Received; it is still being worked on' if left_out is None else
                   f'Left out: {left_out}' if left_out else f'Taken in as {name}.')
        self._tell(HTTPStatus.OK, {'verdict': verdict, **_known(self.server.progress())})

    def _place(self) -> str | None:
        """Return what of the path is below the token; None where that is wrong."""
        parts = self.path.split('/', 2)
        token, place = parts[1:] if len(parts) == 3 else ('', '')
        # In a time that does not depend on where they differ
        right = hmac.compare_digest(token.encode(errors='replace'), self.server.token.encode())
        return place if right else None

    def _tell(self, status: HTTPStatus, content: dict[str, Any]) -> None:
        self._answer(status, json.dumps(content).encode(), 'application/json')

    def _answer(self, status: HTTPStatus, body: bytes, kind: str, nonce: str = '') -> None:
        self.send_response(status)
        allowed = (f"script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; "
                   'img-src data:; ' if nonce else '')
        for name, value in (
                ('Content-Type', f'{kind}; charset=utf-8'), ('Content-Length', str(len(body))),
                ('Cache-Control', 'no-store'), ('Referrer-Policy', 'no-referrer'),
                ('X-Content-Type-Options', 'nosniff'), ('X-Frame-Options', 'DENY'),
                ('Content-Security-Policy', f"{allowed}default-src 'none'; base-uri 'none'")):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *words: Any) -> None:
        """Log nothing: the terminal belongs to the photos, and the address is a secret."""


def _known(progress: Progress) -> dict[str, Any]:
    """Return the progress for the page: lines, sketch (a data URL or None), if there is a goal."""
    drawn = None
    if progress.sketch is not None:
        _, png = cv2.imencode('.png', progress.sketch[..., ::-1])
        drawn = f'data:image/png;base64,{base64.b64encode(png.tobytes()).decode()}'
    return {'lines': list(progress.lines), 'sketch': drawn, 'goal': progress.has_goal}
