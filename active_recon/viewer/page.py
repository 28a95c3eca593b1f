"""The page: the loop as a 3D scene, and a panel of text, charts and controls."""

from collections import deque
from collections.abc import Sequence
from contextlib import suppress
import math
import re
from typing import Any

from active_recon.errors import ConfigError
from active_recon.parameters.viewer import HIGHEST_PORT
from active_recon.viewer.address import HOST
from active_recon.viewer.own_origin import own_origins_only
from active_recon.viewer.scene import Scene
from active_recon.viewer.state import entropy_lines, LoopState
import numpy as np
from numpy.typing import NDArray
import rich
from viser import ClientHandle, uplot, ViserServer

UPDATES_PER_S = 30.0
_LOWEST, _HIGHEST = 0.02, 0.98  # smaller probabilities are not published
_FALLBACK_THRESHOLD = 0.5
_NO_IMAGE = np.zeros((1, 1, 3), np.uint8)
_LOOK_FROM = (2.1, -1.7, 2.5)  # sides of the voxel grid
_LOOK_AT = (0.0, 0.0, -0.05)
_PUNCTUATION = re.compile(r'([!-/:-@\[-`{-~])')  # all that Markdown lets be escaped
_LEGEND = """
The blocks are the occupied cells; darker blocks are more certain. A coloured camera with a
picture is a view that was taken, the grey camera is where the camera is now, and the yellow one
is the next view. The bars around the turntable are the planner's scores of the candidate views;
the best one is yellow.
"""


def _readable(words: str) -> str:
    """Return words in UTF-8, the only ones that a browser takes; names of files may be others."""
    return words.encode(errors='replace').decode()


def _literal(line: str) -> str:
    """Return Markdown that shows a line as it is: names of files and topics are in it."""
    return _PUNCTUATION.sub(r'\\\1', ' '.join(_readable(line).split()))


def slider_value(slider: Any) -> Any:
    """Return a slider's value; one that is typed beyond its ends is there until it is left."""
    return min(max(slider.value, slider.min), slider.max)


def _entropy_scales(count: int, missed: int = 0) -> dict[str, uplot.Scale]:
    """Return the axes' scales for `count` views after some, with a margin on either side."""
    return {'x': uplot.Scale(time=False, range=(missed + 0.0, missed + count + 1.0))}


def _zoom_out_in_narrow_window(client: ClientHandle) -> None:
    if client.camera.aspect < 1:
        with client.atomic():
            client.camera.position = 1.5 * np.array(_LOOK_FROM)
            client.camera.look_at = np.array(_LOOK_AT)


class Page:
    """
    A page on 127.0.0.1 that shows the state of the loop.

    All methods are to be called from one thread. `object_size` is the side of the voxel grid in
    metres; `has_front`: whether +x of the object frame is called its front. Where the port is in
    use the page is served at the next free one, see `url`.
    """

    def __init__(self, title: str, object_size: float = 1.0, port: int = 0,
                 has_front: bool = True) -> None:
        if not 0 <= port <= HIGHEST_PORT:
            raise ConfigError(f'port: out of range: expected 0 (any) to {HIGHEST_PORT}, '
                              f'got {port}')
        # viser prints its address on rich's global console, which is not used otherwise
        rich.get_console().quiet = True
        with own_origins_only():
            self._server = ViserServer(HOST, port, label=_readable(title), verbose=False)
        self.url = f'http://{HOST}:{self._server.get_port()}'
        self.port_taken = port not in (0, self._server.get_port())
        self._clicked: deque[str] = deque()
        self._server.gui.configure_theme(
            control_width='medium', show_logo=False, show_share_button=False,
            brand_color=(37, 99, 168))
        self._server.gui.main_panel.dock_right()
        self._server.initial_camera.position = _LOOK_FROM
        self._server.initial_camera.look_at = _LOOK_AT
        self._server.on_client_connect(_zoom_out_in_narrow_window)
        self._scene = Scene(self._server.scene, object_size, has_front)
        self._text = self._server.gui.add_markdown('')
        self._picture: Any = self._server.gui.add_image(_NO_IMAGE, visible=False)
        self._controls = self._server.gui.add_folder('Controls')
        self._build_figures()
        self._buttons: dict[str, Any] = {}
        self._shown_text: Sequence[str] = ()
        self._own_threshold = _FALLBACK_THRESHOLD
        self._shown_views: object = None
        self._shown_missed = 0
        self._shown_image: object = None

    def _build_figures(self) -> None:
        gui = self._server.gui
        with self._controls:
            self._threshold: Any = gui.add_slider(
                'Threshold', _LOWEST, _HIGHEST, 0.01, _FALLBACK_THRESHOLD,
                hint='Cells with a higher probability of occupancy are shown.')
            self._in_colors: Any = gui.add_checkbox(
                'In colours', False, visible=False,
                hint='Show the surface in the colours of the views.')
        # On a phone this panel is collapsed at first and leaves the space to the object
        panel = gui.add_panel()
        panel.dock_below(gui.main_panel)
        with panel.add_tab('Entropy, nats'):
            self._no_entropy = gui.add_markdown('The uncertainty after each view.')
            self._entropy = gui.add_uplot(
                (*entropy_lines(()),), ({'label': 'view'}, {
                    'label': 'entropy', 'stroke': 'rgb(37, 99, 168)', 'width': 2,
                    'points': {'show': True, 'size': 8, 'fill': 'rgb(37, 99, 168)'}}),
                scales=_entropy_scales(0), legend={'show': False}, height=170, visible=False,
                axes=({'incrs': (1.0, 2.0, 5.0)}, {'size': 60.0}), padding=(12, 24, 0, 0))
        with panel.add_tab('Network image'):
            self._no_image = gui.add_markdown('The last view as the network received it.')
            self._image: Any = gui.add_image(_NO_IMAGE, visible=False)
        with panel.add_tab('Legend'):
            gui.add_markdown(_LEGEND)

    def add_button(self, label: str, hint: str) -> None:
        """Add a button; `clicks` returns its clicks by its label."""
        with self._controls:
            button = self._server.gui.add_button(label, hint=hint)
        button.on_click(lambda _: self._clicked.append(label))
        self._buttons[label] = button

    def enable(self, label: str, possible: bool) -> None:
        """Enable a button, or disable it."""
        if self._buttons[label].disabled is possible:
            self._buttons[label].disabled = not possible

    def add_steps(self, count: int, label: str) -> Any:
        """Add a slider from 1 to `count` and return it; `value` is its position."""
        with self._controls:
            return self._server.gui.add_slider(
                label, 1, max(count, 1), 1, 1, disabled=count < 2, order=-1)

    def clicks(self) -> list[str]:
        """Return the labels of the buttons clicked since the last call, in their order."""
        clicked = []
        with suppress(IndexError):
            while True:
                clicked.append(self._clicked.popleft())
        return clicked

    def set_text(self, lines: Sequence[str]) -> None:
        """Show lines of text at the top of the panel, the first one in bold."""
        if lines != self._shown_text:
            self._shown_text = lines
            first, *rest = map(_literal, lines)
            self._text.content = '\n\n'.join([f'**{first}**', *rest])

    def set_picture(self, image: NDArray[np.uint8] | None) -> None:
        """Show a picture, (H, W, 3) uint8 RGB, below the text; None: no picture."""
        self._picture.visible = image is not None
        if image is not None:
            self._picture.image = image

    @property
    def in_colors(self) -> bool:
        """Whether the surface in colours is asked for."""
        return bool(self._in_colors.value)

    def offer_colors(self) -> None:
        """Let the surface in colours be asked for."""
        if not self._in_colors.visible:
            self._in_colors.visible = True

    def draw(self, state: LoopState) -> None:
        """Show a state; only what has changed since the last is sent."""
        if state.surface is not None:
            self.offer_colors()
        if not self._server.get_clients():  # a later client is shown the state of its time
            return
        if state.threshold is not None and self._threshold.value == self._own_threshold:
            # The loop's own threshold, until the slider is moved
            self._own_threshold = min(max(state.threshold, _LOWEST), _HIGHEST)
            self._threshold.value = self._own_threshold
        with self._server.atomic():
            self._scene.draw(state, slider_value(self._threshold), self._in_colors.value)
        if state.views is not self._shown_views or state.missed != self._shown_missed:
            self._shown_views, self._shown_missed = state.views, state.missed
            numbers, entropies = entropy_lines(state.views, state.missed)
            known = any(not math.isnan(value) for value in entropies)
            self._no_entropy.visible, self._entropy.visible = not known, known
            if known:
                self._entropy.data = (numbers, entropies)
                self._entropy.scales = _entropy_scales(len(numbers), state.missed)

        self._draw_image(state)

    def _draw_image(self, state: LoopState) -> None:
        image = state.network_image
        if image is self._shown_image:
            return
        self._shown_image = image
        self._no_image.visible, self._image.visible = image is None, image is not None
        if image is not None:
            self._image.image = image

    def set_object_size(self, object_size: float) -> None:
        """Set the side of the voxel grid, metres."""
        self._scene.set_object_size(object_size)

    def notify(self, title: str, text: str) -> None:
        """Show a notification for some seconds on every client."""
        for client in self._server.get_clients().values():
            client.add_notification(title, text, auto_close_seconds=12.0)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


