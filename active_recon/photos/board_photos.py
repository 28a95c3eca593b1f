"""Photos in which a printed ChArUco board is seen: each finds its own camera."""

from collections.abc import Callable, Sequence
from pathlib import Path

from active_recon.calibration.board import Board, Detection
from active_recon.calibration.lens import board_pose, estimate_lens, project, read_lens
from active_recon.errors import DataError
from active_recon.photos.camera_file import CameraFile, PosedPhoto
from active_recon.photos.files import PhotoFile, read_photo
import cv2
import numpy as np

_FEWEST = 3
_LARGEST_ERROR = 0.004  # of the photo's longer side, RMS: beyond, it is a wrong pose
FACE_UP = np.diag([1.0, -1.0, -1.0, 1.0])
"""The frame of the photos' world in that of the board, whose z points down, (4, 4)."""


def board_photos(photos: Sequence[PhotoFile], board: Board, lens_file: Path | None = None,
                 advance: Callable[[int, str], None] = lambda steps, note: None
                 ) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
    """
    Return the cameras of the photos that show the board, and why others are left out.

    The world has z up and its origin at the board's first corner; metres. All photos are of one
    lens: that of `lens_file`, in ROS's YAML format, or estimated from the photos of the most
    frequent size. Raises DataError where fewer than three photos show the board.
    """
    seen, left_out = _detections(photos, board, advance)
    sizes = [found.size for _, found in seen]
    if len(seen) < _FEWEST:
        raise DataError(f'board: seen in {len(seen)} of {len(photos)} photos: expected it in '
                        f'{_FEWEST} or more; check that it has {board.columns} x {board.rows} '
                        f'squares and the dictionary {board.dictionary}, that it is sharp, and '
                        'that several of its squares stay free', 'too_few_images')
    lens = read_lens(lens_file) if lens_file else estimate_lens(
        [found for _, found in seen if found.size == max(sizes, key=sizes.count)]).lens
    posed = []
    for photo, found in seen:
        if found.size != (lens.width, lens.height):
            left_out.append(f'{photo.name}: another size: expected {lens.width} x {lens.height} '
                            f'pixels of one lens, got {found.size[0]} x {found.size[1]}')
            continue
        try:
            pose = board_pose(lens, found)
        except cv2.error:  # corners that no plane fits
            left_out.append(f'{photo.name}: no pose of the board fits its corners')
            continue
        apart = project(lens, found.points, pose) - found.pixels
        error = float(np.sqrt((apart ** 2).sum(axis=1).mean()))
        if error > _LARGEST_ERROR * max(found.size):
            left_out.append(f'{photo.name}: the board does not fit: expected its corners within '
                            f'{_LARGEST_ERROR * max(found.size):.1f} pixels, got {error:.1f}; is '
                            'it flat, and the lens that of the other photos?')
            continue
        world = np.linalg.inv(pose @ FACE_UP)
        posed.append(PosedPhoto(photo, np.asarray(world), lens, upright=False))
    if not posed:
        raise DataError(f'no photo fits its board: {"; ".join(left_out[:3])}', 'too_few_images')
    file = CameraFile('board', (), np.array([0.0, 0.0, 1.0]), metric=True, board=board)
    return file, posed, left_out


def _detections(photos: Sequence[PhotoFile], board: Board, advance: Callable[[int, str], None]
                ) -> tuple[list[tuple[PhotoFile, Detection]], list[str]]:
    seen, left_out = [], []
    for photo in photos:
        try:
            pixels = read_photo(photo, upright=False)  # a lens has no portrait format
            found = board.detect(np.ascontiguousarray(pixels[..., 2::-1]), photo.name)
        except DataError as error:
            left_out.append(str(error))
            found = None
        else:
            if found is None:
                left_out.append(f'{photo.name}: no board seen in it')
        if found is not None:
            seen.append((photo, found))
        advance(1, photo.name)
    return seen, left_out
