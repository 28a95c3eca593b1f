"""The live page of photos that arrive: the shape, where to stand next, and how good it is."""

from dataclasses import replace
from typing import Any

from active_recon.photos.shape import Shape
from active_recon.viewer.page import Page
from active_recon.viewer.state import LoopState, Scores, thumbnail
from active_recon.viewer.view_result import Surface, ViewResult
from active_recon.watching.advice import Advice
from active_recon.watching.watcher import Progress
import cv2
import numpy as np
from numpy.typing import NDArray

_SKIP = 'Nobody can stand there'
_QUIET = 2  # modules of white around the code
_MODULE = 6  # pixels


def loop_state(shape: Shape, advice: Advice | None) -> LoopState:
    """Return what the page shows of a shape and of the next view."""
    views = tuple(ViewResult(number, view.camera, thumbnail(view.image), view.known.grid.entropy(),
                             quality=view.known.quality)
                  for number, view in enumerate(shape.views, 1))
    image = shape.views[-1].known.image
    state = LoopState('photos', views, shape.grid, shape.threshold,
                      None if image is None else np.ascontiguousarray(image[..., :3]))
    if advice is None:
        return state
    goal = advice.goal
    if goal is None:
        return replace(state, done=advice.done)
    scores = Scores(np.array([each.position for each in goal.candidates]), goal.scores)
    if advice.done:
        return replace(state, scores=scores, done=advice.done)
    return replace(state, scores=scores, goal=goal.camera, goal_reason=advice.why)


def _surface(shape: Shape) -> Surface | None:
    """Return a shape's surface in colours; None where no cell is occupied."""
    if not shape.grid.occupied(shape.threshold).any():
        return None
    mesh = shape.mesh()
    painted: Any = mesh.visual
    colors = np.asarray(painted.vertex_colors, np.uint8)[mesh.faces][..., :3]
    return Surface(mesh.triangles, colors)


def qr_code(words: str) -> NDArray[np.uint8]:
    """Return words for a phone's camera to read, (H, W, 3) uint8 RGB."""
    code = np.pad(cv2.QRCodeEncoder.create().encode(words), _QUIET, constant_values=255)
    return np.repeat(code.repeat(_MODULE, 0).repeat(_MODULE, 1)[..., None], 3, axis=2)


class WatchPage:
    """
    The page, on this machine only; see `Page` for the port. Call `draw` repeatedly.

    `upload_url` is the address for a phone, '' for none, shown until there is a sketch.
    """

    def __init__(self, port: int, upload_url: str) -> None:
        self._page = Page('active_recon, photos', 1.0, port, has_front=False)
        self.url = self._page.url
        self._page.offer_colors()
        self._page.add_button(_SKIP, 'Ask for the next best place instead.')
        self._page.enable(_SKIP, False)
        self._invitation = qr_code(upload_url) if upload_url else None
        self._shown: Progress | None = None
        self._state = LoopState()
        self._colored: Shape | None = None

    def skips(self) -> bool:
        """Return whether the place that is told was to be skipped since the last call."""
        return bool(self._page.clicks())

    def draw(self, progress: Progress) -> None:
        """Show the progress; only what has changed is sent."""
        if progress is not self._shown:
            self._show(progress)
        shape = progress.shape
        if self._page.in_colors and shape is not None and shape is not self._colored:
            self._colored = shape
            self._state = replace(self._state, surface=_surface(shape))
        self._page.draw(self._state)

    def _show(self, progress: Progress) -> None:
        before = None if self._shown is None else self._shown.shape
        self._shown = progress
        self._page.enable(_SKIP, progress.has_goal)
        invited = progress.sketch is None and self._invitation is not None
        self._page.set_text([
            *progress.lines,
            *(['From this code a phone reads where to send photos.'] if invited else [])])
        self._page.set_picture(self._invitation if invited else progress.sketch)
        if progress.shape is None:
            self._state = LoopState()
            return
        if before is None or before.size != progress.shape.size:
            self._page.set_object_size(progress.shape.size)
        surface = self._state.surface if progress.shape is before else None
        self._state = replace(loop_state(progress.shape, progress.advice), surface=surface)

    def close(self) -> None:
        """Stop serving."""
        self._page.close()

