"""Colours, text and tiles on an RGB picture."""

from active_recon.view_colors import Color
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

PAPER: Color = (250, 250, 252)
INK: Color = (44, 48, 58)
QUIET: Color = (170, 176, 188)


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
