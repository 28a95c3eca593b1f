"""The photos that came so far, each read and searched once, and the shape made of them."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from active_recon.errors import ActiveReconError, ConfigError, DataError
from active_recon.photos.board_photos import (
    FEWEST,
    posed_on_board,
    seen_board,
    SeenPhoto,
)
from active_recon.photos.camera_file import CameraFile, PosedPhoto
from active_recon.photos.files import open_photo, PhotoFile
from active_recon.photos.options import Options
from active_recon.photos.readers import camera_files
from active_recon.photos.reconstruct import from_views
from active_recon.photos.shape import Shape
from active_recon.photos.sources import (
    BoardCameras,
    place_of_cameras,
    posed_by,
    SfmCameras,
    Source,
    TurntableCameras,
)
from active_recon.photos.views import load_view, PhotoView, require_masks, with_camera
from active_recon.reconstructor import load

Files = Mapping[Path, tuple[int, int]]
"""Sizes of files, and the times of their last changes, nanoseconds."""


class _CamerasError(DataError):
    """The file of cameras cannot be used, whichever photos there are."""


@dataclass(frozen=True, eq=False)
class _Kept:
    """A photo, and what was seen of the board in it, where a board poses the photos."""

    photo: PhotoFile
    seen: SeenPhoto | None


class Collection:
    """
    Photos that arrive one after the other, and the shape of all of them.

    It is the shape that `from_files` makes of the same photos in the order of their arrival.

    - shape: None while there are too few photos for one; `waiting` then says what is missing
    - metric: whether lengths are in metres for certain

    Raises ConfigError for a source that cannot pose a photo by itself.
    """

    def __init__(self, source: Source | None, options: Options) -> None:
        if isinstance(source, TurntableCameras | SfmCameras):
            raise ConfigError('photos that arrive: expected a board or a file of cameras; a '
                              'turntable and structure from motion need all photos at once')
        self._source = source
        self._options = options
        self._reconstructor = load(options.model, threads=options.threads)
        self._kept: dict[Path, _Kept] = {}
        self._views: dict[Path, PhotoView] = {}
        self._digests: dict[bytes, Path] = {}
        self._read_cameras: Files = {}
        self.shape: Shape | None = None
        self.metric = False
        self.waiting = 'no photo yet'

    @property
    def board(self) -> BoardCameras | None:
        """The board that poses the photos, if one does."""
        return self._source if isinstance(self._source, BoardCameras) else None

    @property
    def count(self) -> int:
        """How many photos were taken in, whether or not the shape uses them."""
        return len(self._kept)

    def add(self, path: Path) -> str:
        """Take in a photo; return why it is left out, in one line, '' where it is used."""
        digests = dict(self._digests)
        if reason := self._open(path):
            return reason
        had_shape = self.shape is not None
        try:
            self._update()
        except ActiveReconError as error:
            if not had_shape:
                self.waiting = self._missing(error)
                return ''
            if isinstance(error, _CamerasError):
                return f'{path.name}: {error}'  # the photo is not at fault: it is kept
            self._digests = digests
            self._forget(path)  # the shape is still that of the others
            return f'{path.name}: {error}'
        return self._left_out(path)

    def add_all(self, paths: Sequence[Path]) -> list[str]:
        """Take in photos as `add` does each, by one shape of all of them if there is one."""
        if len(paths) > 1:
            before = dict(self._kept), dict(self._views), dict(self._digests)
            reasons = [self._open(path) for path in paths]
            try:
                self._update()
            except ActiveReconError:  # one by one it is seen which of them is at fault
                self._kept, self._views, self._digests = before
            else:
                return [reason or self._left_out(path)
                        for path, reason in zip(paths, reasons, strict=True)]
        return [self.add(path) for path in paths]

    def _open(self, path: Path) -> str:
        """Keep a photo; return why it cannot be read, else ''."""
        digests = dict(self._digests)
        self._digests = self._digests_without(path)
        try:
            photo = open_photo(path, self._digests)
            seen = None if self.board is None else seen_board(photo, self.board.board)
        except DataError as error:
            self._digests = digests
            return str(error)
        self._kept[path] = _Kept(photo, seen)
        return ''

    def _left_out(self, path: Path) -> str:
        """Return why the shape does not use a photo, '' where it does."""
        assert self.shape is not None
        return next((reason for reason in self.shape.left_out
                     if reason.startswith(f'{path.name}: ')), '')

    def remove(self, *paths: Path) -> None:
        """Leave out photos that are gone; the shape becomes that of the others."""
        gone = [path for path in paths if path in self._kept]
        if not gone:
            return
        for path in gone:
            self._forget(path)
            self._digests = self._digests_without(path)
        try:
            self._update()
        except ActiveReconError as error:
            self.shape, self.waiting = None, self._missing(error)

    def new_cameras(self) -> Files:
        """Return the files of cameras, none where they are those that the shape was made with."""
        found = self._camera_files()
        return {} if found == self._read_cameras else found

    def read_cameras_again(self) -> str:
        """
        Make the shape by the cameras as they are now.

        A shape stays where they cannot be used; returns why, else ''.
        """
        try:
            self._update()
        except ActiveReconError as error:
            self.waiting = self._missing(error)
            return '' if self.shape is None else str(error)
        return ''

    def _digests_without(self, path: Path) -> dict[bytes, Path]:
        return {digest: each for digest, each in self._digests.items() if each != path}

    def _forget(self, path: Path) -> None:
        self._kept.pop(path, None)
        self._views.pop(path, None)

    def _update(self) -> None:
        """Make the shape of all photos; raises ActiveReconError, and then it stays as it was."""
        if not self._kept:
            raise DataError('no photo yet')
        file, posed, left_out = self._posed()
        views, unread = [], []
        for each in posed:
            try:
                views.append(self._view(each))
            except DataError as error:
                unread.append(str(error))
        if not views:
            raise DataError(unread[0])
        require_masks(views, self._options.masks)
        self.shape = from_views(views, file, self._options, [*left_out, *unread],
                                reconstructor=self._reconstructor)
        self.metric, self.waiting = file.metric, ''

    def _posed(self) -> tuple[CameraFile, list[PosedPhoto], list[str]]:
        if self.board is None:
            photos = [kept.photo for kept in self._kept.values()]
            self._read_cameras = self._camera_files()
            try:
                return posed_by(self._source, photos, self._options.axes)
            except DataError as error:
                raise _CamerasError(str(error), error.kind) from error
        seen = [kept.seen for kept in self._kept.values() if kept.seen is not None]
        return posed_on_board(seen, self.board.board, self.board.lens_file)

    def _camera_files(self) -> Files:
        found: dict[Path, tuple[int, int]] = {}
        if self.board is not None or not self._kept:
            return found
        assert self._source is None or isinstance(self._source, Path)
        place = place_of_cameras(self._source, next(iter(self._kept)).parent)
        with suppress(OSError):  # gone since
            for path in [] if place is None else camera_files(place):
                status = path.stat()
                found[path] = status.st_size, status.st_mtime_ns
        return found

    def _view(self, posed: PosedPhoto) -> PhotoView:
        """Return the view of a posed photo, whose pixels are read once."""
        path = posed.photo.path
        if path in self._views:
            return with_camera(self._views[path], posed)
        self._views[path] = load_view(posed, self._options.masks)
        return self._views[path]

    def _missing(self, error: ActiveReconError) -> str:
        """Return what is missing for a shape, in one line."""
        count = len(self._kept)
        if 0 < count < FEWEST and error.kind == 'too_few_images':
            return (f'{count} photo{"s" if count > 1 else ""} with the board: the lens is '
                    'estimated from three, taken from different sides')
        if count and error.kind == 'no_cube':
            return f'no object found yet: {error}'
        return f'not enough yet: {error}' if count else str(error)
