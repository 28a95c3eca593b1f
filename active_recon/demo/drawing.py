"""Colours, text and tiles on an RGB picture."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Color = tuple[int, int, int]
PAPER: Color = (250, 250, 252)
INK: Color = (44, 48, 58)
QUIET: Color = (170, 176, 188)
_VIEW_COLORS: tuple[Color, ...] = (
    (37, 99, 168), (217, 95, 2), (27, 136, 105), (190, 43, 110), (109, 80, 172), (140, 100, 20))


def view_color(number: int) -> Color:
    """Return the colour of a view, numbered from 1; they repeat after six."""
    return _VIEW_COLORS[(number - 1) % len(_VIEW_COLORS)]


def text(picture: NDArray[np.uint8], words: str, at: tuple[int, int], size: int,
         color: Color = INK, anchor: str = 'ls') -> None:
    """Write words at a point, (x, y) pixels: by default the left end of their base line."""
    written = Image.fromarray(picture)
    ImageDraw.Draw(written).text(
        at, words, fill=color, font=ImageFont.load_default(size), anchor=anchor)
    picture[:] = np.asarray(written)


def centred(picture: NDArray[np.uint8], words: str, x: int, y: int, size: int,
            color: Color = INK) -> None:
    """Write words with their base line's middle at (x, y) pixels."""
    text(picture, words, (x, y), size, color, anchor='ms')


def paste(picture: NDArray[np.uint8], tile: NDArray[np.uint8], left: int, top: int) -> None:
    """Lay a tile over the picture; it must lie inside."""
    picture[top:top + tile.shape[0], left:left + tile.shape[1]] = tile
