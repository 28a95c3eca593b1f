"""Where the cameras of photos come from: a file, a board, a turntable's steps, or the photos."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from active_recon.calibration.board import Board
from active_recon.errors import ConfigError, DataError
from active_recon.photos.board_photos import board_photos
from active_recon.photos.camera_file import CameraFile, posed_photos, PosedPhoto
from active_recon.photos.files import PhotoFile
from active_recon.photos.readers import find_cameras, FORMATS, read_cameras
from active_recon.photos.structure_from_motion import sfm_photos
from active_recon.photos.turntable_photos import turntable_photos
from active_recon.reporting import Reporting, silent


@dataclass(frozen=True)
class BoardCameras:
    """A printed board in the photos; the lens is read from a file or estimated from them."""

    board: Board
    lens_file: Path | None = None


@dataclass(frozen=True)
class TurntableCameras:
    """
    Steps of a turntable before a fixed camera, in the order of the photos' names.

    See `turntable_photos`: radians and metres.
    """

    step: float
    elevation: float
    distance: float
    field_of_view: float | None = None


@dataclass(frozen=True)
class SfmCameras:
    """Structure from motion: photos that overlap, of which nothing is known, see `sfm_photos`."""


Source = Path | BoardCameras | TurntableCameras | SfmCameras


def posed_by(source: Source | None, photos: Sequence[PhotoFile], axes: str | None = None,
             reporting: Reporting = silent) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
    """
    Return the cameras, the photos that have one, and why others have none.

    `source` None is the file of cameras beside the photos, or in the folder above; `axes` is for
    files alone, see `read_cameras`. Raises DataError where no photo has a camera, ConfigError on
    `axes` without a file.
    """
    if axes is not None and source is not None and not isinstance(source, Path):
        raise ConfigError('axes: without a file of cameras: they are those of its format')
    if isinstance(source, BoardCameras):
        with reporting('searching the board', len(photos)) as advance:
            return board_photos(photos, source.board, source.lens_file, advance)
    if isinstance(source, TurntableCameras):
        file, posed = turntable_photos(photos, source.step, source.elevation, source.distance,
                                       source.field_of_view)
        return file, posed, []
    if isinstance(source, SfmCameras):
        return sfm_photos(photos, reporting)
    folder = photos[0].path.parent
    path = place_of_cameras(source, folder)
    if path is None:
        raise DataError(f'{folder}: no cameras beside the photos: expected {FORMATS}; name the '
                        'file by --cameras, or let --sfm find them from photos that overlap',
                        'no_cameras')
    file = read_cameras(path, photos, axes)
    posed, left_out = posed_photos(file, photos)
    if any(each.is_turned for each in posed):
        file = replace(file, as_seen=[each.as_seen for each in posed])
    return file, posed, left_out


def require_found(source: Source | None, masks: Path | None) -> None:
    """Raise ConfigError on what is looked up by names of photos, which frames do not have."""
    if not isinstance(source, BoardCameras | SfmCameras):
        raise ConfigError('cameras of a video: expected a board in it or structure from motion, '
                          'which find them in its frames: --board or --sfm, in Python '
                          'BoardCameras or SfmCameras')
    if masks is not None:
        raise ConfigError('masks with a video: its frames have no names to find masks by')


def place_of_cameras(source: Path | None, folder: Path) -> Path | None:
    """Return the file or folder of the cameras of photos in a folder; None where none is found."""
    return source or find_cameras([folder, folder.parent])
