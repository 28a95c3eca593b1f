"""What a file of cameras says, in one form for all formats, and which photo each camera took."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from active_recon.calibration.board import Board
from active_recon.errors import DataError, ViewError
from active_recon.file_names import comparable
from active_recon.geometry.cameras import Intrinsics
from active_recon.photos.files import PhotoFile
import numpy as np
from numpy.typing import NDArray

Lens = Callable[[tuple[int, int]], Intrinsics]
"""Gives the intrinsics by a photo's width and height; raises ViewError where these do not fit."""
_SHAPE_OFF = 0.01
_AS_SEEN = {3: [[-1, 0], [0, -1]], 6: [[0, 1], [-1, 0]], 8: [[0, -1], [1, 0]]}
"""By EXIF's orientation: x and y of a photo as it is seen in those of the stored one, (2, 2)."""


@dataclass(frozen=True, eq=False)
class Entry:
    """
    One camera of a file.

    - name: of the photo, as the file has it, perhaps with folders or without a suffix
    - pose: world from optical frame (z forward, x right, y down), (4, 4), in the file's units
    - depth: the depth image that the file names, or None
    """

    name: str
    pose: NDArray[np.float64]
    lens: Lens
    depth: Path | None = None


@dataclass(frozen=True, eq=False)
class CameraFile:
    """
    All cameras of a file.

    - up: the world's direction that points up, (3,), or None where the format does not tell
    - box: the object's corners, least and greatest, (2, 3), in the file's units, if it has them
    - looks: 'opencv' or 'opengl', the camera axes that the file was read with
    - metric: whether the units are metres for certain
    - board: the printed board that lies in the world's plane z = 0, under or beside the object
    - stored: whether the cameras are those of photos as stored, which EXIF has not turned
    - as_seen: poses, (4, 4), of its photos turned as EXIF says, where that turns some that are
      taken as stored
    """

    source: str
    entries: Sequence[Entry]
    up: NDArray[np.float64] | None = None
    box: NDArray[np.float64] | None = None
    looks: str = 'opencv'
    metric: bool = False
    board: Board | None = None
    stored: bool = False
    as_seen: Sequence[NDArray[np.float64]] = ()


@dataclass(frozen=True, eq=False)
class PosedPhoto:
    """
    A photo and its camera.

    - pose: world from optical frame, (4, 4), in the file's units
    - intrinsics: for the photo's own size, turned by EXIF if `upright`
    - depth: its depth image, where the cameras' file names one
    """

    photo: PhotoFile
    pose: NDArray[np.float64]
    intrinsics: Intrinsics
    upright: bool = True
    depth: Path | None = None

    @property
    def as_seen(self) -> NDArray[np.float64]:
        """The pose, (4, 4), of the photo turned as EXIF says."""
        pose = self.pose.copy()
        if self.is_turned:
            pose[:3, :2] = pose[:3, :2] @ _AS_SEEN[self.photo.orientation]
        return pose

    @property
    def is_turned(self) -> bool:
        """Whether the photo is taken as stored and EXIF would turn it."""
        return not self.upright and self.photo.orientation in _AS_SEEN


def sized(lens: Intrinsics) -> Lens:
    """Return the lens of photos of a known size; others of the same shape are scaled ones."""
    def of_size(size: tuple[int, int]) -> Intrinsics:
        width, height = size
        if abs(width * lens.height / (height * lens.width) - 1) > _SHAPE_OFF:
            raise ViewError(f'another size: expected {lens.width} x {lens.height} pixels, as its '
                            f'camera says, or the same shape, got {width} x {height}',
                            'image_size')
        return lens if size == (lens.width, lens.height) else lens.resized(width, height)
    return of_size


def posed_photos(cameras: CameraFile, photos: Sequence[PhotoFile]
                 ) -> tuple[list[PosedPhoto], list[str]]:
    """
    Return the photos that the file has cameras for, in their order, and why others are left out.

    A name fits with or without folders and suffix, if it fits one photo only. Where several fit a
    photo, those count that have the most of its folders. Raises DataError where no camera has a
    photo.
    """
    by_photo = _matched(cameras.entries, photos)
    found, left_out = [], []
    for photo in photos:
        entries = by_photo.get(photo.path, [])
        if not entries:
            left_out.append(f'{photo.name}: no camera in {cameras.source}')
            continue
        if any(not np.array_equal(entries[0].pose, other.pose) for other in entries[1:]):
            left_out.append(f'{photo.name}: {len(entries)} cameras of that name in '
                            f'{cameras.source}, as different as {entries[0].name} and '
                            f'{entries[1].name}')
            continue
        try:
            found.append(_posed(entries[0], photo, cameras.stored))
        except ViewError as error:
            left_out.append(f'{photo.name}: {error}')
    if not by_photo:
        some = ', '.join(entry.name for entry in cameras.entries[:3])
        raise DataError(f'{cameras.source}: cameras of other photos: expected some of '
                        f'{photos[0].name}, ..., got those of {some or "none"}', 'other_photos')
    if not found:
        raise DataError(f'no photo fits its camera: {"; ".join(left_out[:3])}', 'other_photos')
    return found, left_out


def _posed(entry: Entry, photo: PhotoFile, stored: bool) -> PosedPhoto:
    """Return a photo turned by EXIF, or if `stored` as stored; the other way if only that fits."""
    def taken(upright: bool) -> PosedPhoto:
        size = photo.upright_size if upright else photo.size
        return PosedPhoto(photo, entry.pose, entry.lens(size), upright, entry.depth)

    try:
        return taken(not stored)
    except ViewError:
        if photo.upright_size == photo.size:
            raise
        return taken(stored)


def _matched(entries: Iterable[Entry], photos: Sequence[PhotoFile]
             ) -> Mapping[Path, list[Entry]]:
    """Return the cameras that fit a photo best, by its path: by name, else by stem; by folders."""
    # A camera's name may have no suffix, but dots; capitals count where they are the same
    ways = ((_as_written, _as_written), (_name, _name), (_name, _stem),
            (_stem, _stem))  # of camera and photo, the best first
    tables: list[dict[str, list[Path]]] = []
    for _, of_photo in ways:
        tables.append({})
        for photo in photos:
            tables[-1].setdefault(of_photo(photo.path.name), []).append(photo.path)
    found: dict[Path, dict[tuple[int, int], list[Entry]]] = {}
    for entry in entries:
        for rank, ((of_camera, _), table) in enumerate(zip(ways, tables, strict=True)):
            fitting = [(_folders_alike(entry.name, path), path)
                       for path in table.get(of_camera(entry.name), [])]
            alike = max((same for same, _ in fitting), default=0)
            best = [path for same, path in fitting if same == alike]
            if len(best) == 1:
                found.setdefault(best[0], {}).setdefault((-rank, alike), []).append(entry)
                break
    return {path: fits[max(fits)] for path, fits in found.items()}


def _folders_alike(name: str, path: Path) -> int:
    """Return how many folders of a name are also those of a path, from the last one up."""
    named = PurePosixPath(comparable(name)).parts[-2::-1]
    there = PurePosixPath(comparable(str(path.resolve()))).parts[-2::-1]
    unlike = (at for at, (a, b) in enumerate(zip(named, there, strict=False)) if a != b)
    return next(unlike, min(len(named), len(there)))


def _as_written(path: str) -> str:
    return PurePosixPath(path.replace('\\', '/')).name


def _name(path: str) -> str:
    return PurePosixPath(comparable(path)).name


def _stem(path: str) -> str:
    return PurePosixPath(_name(path)).stem


def rigid(rotation: NDArray[np.float64], position: NDArray[np.float64],
          where: str) -> NDArray[np.float64]:
    """
    Return a pose (4, 4) of a rotation (3, 3) and a position (3,), made exactly orthogonal.

    Raises DataError where the matrix is far from a rotation, or the position not finite; `where`
    begins its message.
    """
    pose = np.eye(4)
    if not np.isfinite(position).all():
        raise DataError(f'{where}: no position: expected finite numbers, got {position.tolist()}')
    if np.isfinite(rotation).all():
        left, _, right = np.linalg.svd(rotation)
        nearest = left @ right
        if np.allclose(nearest, rotation, atol=1e-2) and np.linalg.det(nearest) > 0:
            pose[:3, :3], pose[:3, 3] = nearest, position
            return pose
    raise DataError(f'{where}: no rotation: expected a finite, orthogonal matrix, got '
                    f'{np.round(rotation, 4).tolist()}')
