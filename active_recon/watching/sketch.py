"""A small picture from above: the board, the object, the photos taken, and the next one."""

import math

from active_recon.calibration.board import Board
from active_recon.geometry.cameras import Camera
from active_recon.photos.shape import Shape
from active_recon.view_colors import Color, view_color
import cv2
import numpy as np
from numpy.typing import NDArray

SIDE = 360
"""Pixels of the picture's side."""
NEXT_COLOR: Color = (250, 196, 0)
_PAPER: Color = (252, 252, 252)
_BOARD: Color = (222, 226, 233)
_INK: Color = (60, 66, 78)
_OBJECT: Color = (110, 140, 170)
_MARGIN = 1.15


def sketch(shape: Shape, goal: Camera | None, board: Board | None = None) -> NDArray[np.uint8]:
    """
    Return the picture, (SIDE, SIDE, 3) uint8 RGB, with the last photo's camera below.

    Who took the last photo sees left and right as they are. The board's first corner, of its
    first marker, is dark.
    """
    cameras = [view.camera for view in shape.views]
    turn = -math.pi / 2 - cameras[-1].azimuth
    cosine, sine = math.cos(turn), math.sin(turn)
    shown = np.array([[cosine, -sine], [sine, cosine]])
    corners = None if board is None else _board_corners(shape, board) @ shown.T
    places = [shown @ camera.position[:2] for camera in cameras]
    there = None if goal is None else shown @ goal.position[:2]
    far = max(float(np.abs(part).max()) for part in (
        *places, *([] if corners is None else [corners]), *([] if there is None else [there])))
    scale = SIDE / 2 / (_MARGIN * max(far, shape.size / 2))
    picture = np.full((SIDE, SIDE, 3), _PAPER, np.uint8)

    def at(place: NDArray[np.floating]) -> tuple[int, int]:
        return round(SIDE / 2 + scale * place[0]), round(SIDE / 2 - scale * place[1])

    if corners is not None:
        cv2.fillPoly(picture, [np.array([at(each) for each in corners], np.int32)], _BOARD,
                     cv2.LINE_AA)
        cv2.circle(picture, at(corners[0]), 6, _INK, -1, cv2.LINE_AA)
    _draw_object(picture, shape, shown, scale)
    if there is not None:
        _draw_way(picture, places[-1], there, scale)
        cv2.circle(picture, at(there), 13, NEXT_COLOR, -1, cv2.LINE_AA)
        cv2.arrowedLine(picture, at(there), at(0.55 * there), NEXT_COLOR, 4, cv2.LINE_AA,
                        tipLength=0.2)
    for number, place in enumerate(places, 1):
        middle = at(place)
        cv2.circle(picture, middle, 10, view_color(number), -1, cv2.LINE_AA)
        words = str(number)
        cv2.putText(picture, words, (middle[0] - 4 * len(words), middle[1] + 4),
                    cv2.FONT_HERSHEY_SIMPLEX, 0.42, (255, 255, 255), 1, cv2.LINE_AA)
    return picture


def _board_corners(shape: Shape, board: Board) -> NDArray[np.float64]:
    """Return the board's corners in the object frame from above, the first one first, (4, 2)."""
    wide, high = board.columns * board.square, board.rows * board.square
    world = np.array([[0, 0, 0, 1], [wide, 0, 0, 1], [wide, -high, 0, 1], [0, -high, 0, 1]])
    return np.asarray((world @ np.linalg.inv(shape.world_from_object).T)[:, :2])


def _draw_object(picture: NDArray[np.uint8], shape: Shape, shown: NDArray[np.float64],
                 scale: float) -> None:
    """Draw the occupied cells as they are seen from above."""
    covered = np.argwhere((shape.occupancy > shape.threshold).any(axis=2))
    centres = ((covered + 0.5) / len(shape.occupancy) - 0.5) * shape.size @ shown.T * scale
    reach = max(1, math.ceil(scale * shape.size / len(shape.occupancy)))
    for across, up in centres:
        cv2.circle(picture, (round(SIDE / 2 + across), round(SIDE / 2 - up)), reach, _OBJECT, -1)


def _draw_way(picture: NDArray[np.uint8], last: NDArray[np.float64], goal: NDArray[np.float64],
              scale: float) -> None:
    """Draw the shorter way around the object, from the last photo towards the goal."""
    start, end = (math.atan2(place[1], place[0]) for place in (last, goal))
    turn = (end - start + math.pi) % (2 * math.pi) - math.pi
    radii = np.linspace(np.hypot(*last), np.hypot(*goal), 40)
    angles = start + np.linspace(0, turn, 40)
    points = np.column_stack([SIDE / 2 + scale * radii * np.cos(angles),
                              SIDE / 2 - scale * radii * np.sin(angles)])
    cv2.polylines(picture, [np.rint(points).astype(np.int32)], False, NEXT_COLOR, 2, cv2.LINE_AA)
