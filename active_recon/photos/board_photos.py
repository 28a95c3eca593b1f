"""Photos in which a printed ChArUco board is seen: each finds its own camera."""

from collections.abc import Callable, Sequence
from pathlib import Path

from active_recon.calibration.board import Board, Detection
from active_recon.calibration.lens import board_pose, estimate_lens, project, read_lens
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
from active_recon.photos.camera_file import CameraFile, PosedPhoto
from active_recon.photos.files import PhotoFile, read_photo
import cv2
import numpy as np
from numpy.typing import NDArray

FEWEST = 3
"""Photos from which the lens is estimated where nothing else is known of it."""
_SAME_FOCAL = 1.03  # ratio: EXIF often has whole millimetres
_LARGEST_ERROR = 0.004  # of the photo's longer side, RMS: beyond, it is a wrong pose
SeenPhoto = tuple[PhotoFile, Detection]
"""A photo, and the board's corners in it."""
FACE_UP = np.diag([1.0, -1.0, -1.0, 1.0])
"""The frame of the photos' world in that of the board, whose z points down, (4, 4)."""


def board_photos(photos: Sequence[PhotoFile], board: Board, lens_file: Path | None = None,
                 advance: Callable[[int, str], None] = lambda steps, note: None
                 ) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
    """
    Return the cameras of the photos that show the board, and why others are left out.

    The rest is as in `posed_on_board`.
    """
    seen, left_out = [], []
    for photo in photos:
        try:
            seen.append(seen_board(photo, board))
        except DataError as error:
            left_out.append(str(error))
        advance(1, photo.name)
    file, posed, unfit = posed_on_board(seen, board, lens_file, len(photos))
    return file, posed, [*left_out, *unfit]


def seen_board(photo: PhotoFile, board: Board) -> SeenPhoto:
    """Return a photo with the board's corners in it; raises DataError where it is not seen."""
    pixels = read_photo(photo, upright=False)  # a lens has no portrait format
    found = board.detect(np.ascontiguousarray(pixels[..., 2::-1]), photo.name)
    if found is None:
        raise DataError(f'{photo.name}: no board seen in it')
    return photo, found


def posed_on_board(seen: Sequence[SeenPhoto], board: Board, lens_file: Path | None = None,
                   of_photos: int = 0) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
    """
    Return the cameras of photos by the corners that were seen, and why others are left out.

    The world has z up and its origin at the board's first corner; metres. All photos are of one
    lens: that of `lens_file`, in ROS's YAML format, or estimated from the photos of the most
    frequent size. One whose focal length by EXIF is not that of most is left out: it was zoomed.
    EXIF's focal length is where the estimate begins, and is the lens where fewer than three photos
    show the board. Raises DataError where no lens or no pose can be found; `of_photos` is the
    number of photos that were searched.
    """
    of_photos = of_photos or len(seen)
    seen, left_out = _of_one_zoom(seen)
    lens = _lens(seen, board, lens_file, of_photos)
    posed = []
    for photo, found in seen:
        own = lens.resized(*found.size) if photo.size == (lens.width, lens.height) else lens
        try:
            pose = _pose(photo.name, found, own)
        except DataError as error:
            left_out.append(str(error))
            continue
        posed.append(PosedPhoto(photo, np.asarray(np.linalg.inv(pose @ FACE_UP)), own,
                                upright=False))
    if not posed:
        raise DataError(f'no photo fits its board: {"; ".join(left_out[:3])}', 'too_few_images')
    file = CameraFile('board', (), np.array([0.0, 0.0, 1.0]), metric=True, board=board)
    return file, posed, left_out


def _of_one_zoom(seen: Sequence[SeenPhoto]) -> tuple[list[SeenPhoto], list[str]]:
    """Return the photos but for those of an unusual focal length by EXIF, and why they are not."""
    def is_near(one: float, other: float) -> bool:
        return 1 / _SAME_FOCAL < one / other < _SAME_FOCAL

    told = [photo.film_focal for photo, _ in seen if photo.film_focal is not None]
    usual = max(told, key=lambda one: sum(is_near(one, other) for other in told), default=0.0)
    kept, left_out = [], []
    for photo, found in seen:
        focal = photo.film_focal
        if focal is None or is_near(focal, usual):
            kept.append((photo, found))
        else:
            left_out.append(f'{photo.name}: another zoom: expected a focal length of {usual:.0f} '
                            f'mm (35 mm equivalent), as others have by EXIF, got {focal:.0f}')
    return kept, left_out


def _lens(seen: Sequence[SeenPhoto], board: Board, lens_file: Path | None,
          of_photos: int) -> Intrinsics:
    if lens_file is not None and seen:
        return read_lens(lens_file)
    sizes = [found.size for _, found in seen]
    same = [each for each in seen if each[1].size == max(sizes, key=sizes.count)]
    # Large photos are searched at a smaller size
    focals = [photo.focal * found.size[0] / photo.size[0] for photo, found in same
              if photo.focal is not None]
    focal = float(np.median(focals)) if focals else None
    if len(seen) >= FEWEST:
        return estimate_lens([found for _, found in same], focal).lens
    if focal is not None:
        width, height = same[0][1].size
        return Intrinsics(focal, focal, width / 2, height / 2, width, height)
    advice = ('take more, or give the lens by --camera-info' if len(seen) == of_photos else
              f'check that it has {board.columns} x {board.rows} squares and the dictionary '
              f'{board.dictionary}, that it is sharp, and that several of its squares stay free')
    raise DataError(f'board: seen in {len(seen)} of {of_photos} photos: expected it in '
                    f'{FEWEST} or more; {advice}', 'too_few_images')


def _pose(name: str, found: Detection, lens: Intrinsics) -> NDArray[np.float64]:
    """Return the board's pose, camera from board (4, 4); raises DataError where none fits."""
    if found.size != (lens.width, lens.height):
        raise DataError(f'{name}: another size: expected {lens.width} x {lens.height} pixels of '
                        f'one lens, got {found.size[0]} x {found.size[1]}')
    try:
        pose = board_pose(lens, found)
    except cv2.error as error:  # corners that no plane fits
        raise DataError(f'{name}: no pose of the board fits its corners') from error
    apart = project(lens, found.points, pose) - found.pixels
    off = float(np.sqrt((apart ** 2).sum(axis=1).mean()))
    if off > _LARGEST_ERROR * max(found.size):
        raise DataError(f'{name}: the board does not fit: expected its corners within '
                        f'{_LARGEST_ERROR * max(found.size):.1f} pixels, got {off:.1f}; is it '
                        'flat, and the lens that of the other photos?')
    return pose
