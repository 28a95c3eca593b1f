"""From photos with known cameras to the shape of the object in them: the whole way in one call."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from active_recon.errors import ConfigError, DataError, ViewError, WeightsError
from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.photos.backgrounds import before_clutter, named, separated, uncut
from active_recon.photos.board_masks import board_views
from active_recon.photos.camera_file import CameraFile
from active_recon.photos.conventions import misreading
from active_recon.photos.cube import Cube, first_cube, NARROWER, upward, WIDER
from active_recon.photos.doubts import better_box, doubts, unknown_front
from active_recon.photos.files import in_order_of, open_photos, photo_paths
from active_recon.photos.ground import BOARD_GROUND, Ground, no_table
from active_recon.photos.ground_search import found_ground
from active_recon.photos.integrating import (
    above_ground,
    are_masked,
    carved,
    found_cube,
    integrate,
)
from active_recon.photos.options import FRAMES, Options
from active_recon.photos.segmented_views import segmented_views
from active_recon.photos.shape import Shape, TakenView
from active_recon.photos.sources import (
    posed_by,
    require_found,
    SfmCameras,
    Source,
    TurntableCameras,
)
from active_recon.photos.video_frames import frames_of, is_video
from active_recon.photos.views import even_choice, load_views, PhotoView, view_of
from active_recon.reconstructor import load, Reconstructor
from active_recon.reporting import Reporting, silent
from active_recon.runtimes import REMARK
from active_recon.segmentation import shipped_segmentation
from active_recon.volumes.meshes import axis_direction
import numpy as np
from numpy.typing import NDArray

T = TypeVar('T')
_DEFAULTS = Options()
_NO_SCALE = ("the scale is not known: the object's longest side is taken for 1 m; give it by "
             '--size')
_EACH_IMAGE = 'files, or with pixels'
_EACH_CAMERA = 'a Camera(pose, intrinsics) for each image'


def reconstruct(images: Path | str | Sequence[Path | str | NDArray[np.uint8]],
                cameras: Source | str | Sequence[Camera] | None = None, size: float | None = None,
                *, background: str = 'auto', masks: Path | str | None = None,
                box: Sequence[float] | None = None, unit: float = 1.0, up: str | None = None,
                views: int | None = None, model: str | Path = DEFAULT_MODEL,
                threads: int | None = 1, order: str = 'name', axes: str | None = None,
                ground: bool = True, frames: int = FRAMES) -> Shape:
    """
    Reconstruct an object from photos of known cameras.

    `images` is a folder, a video, a list of files, or of pixels, (H, W, 3 or 4) uint8 RGB(A).
    `cameras` is a file in one of the known formats (None: the one beside the photos), another
    `Source`, or a camera for each image in the object frame, whose origin is the centre of the
    object's cube.
    `size` is the side of that cube in metres. With a camera file it only sets the scale, and the
    cube is found unless `box` (x, y, z, side, in the file's units) or the file tells it. The rest
    is as in `Options`; `masks`, `unit` (instead of `size`) and `order` are for files alone, `axes`
    for those of cameras. Raises ActiveReconError where no photo can be used.
    """
    options = Options(box, unit, size, up, axes, background, None if masks is None else
                      Path(masks), views, model, threads, order, ground, frames)
    if isinstance(cameras, str):
        cameras = Path(cameras)
    if cameras is not None and not isinstance(cameras, Source):
        if isinstance(images, Path | str):
            raise ConfigError('images: expected pixels for a list of cameras, got the path '
                              f'{images}')
        return _of_cameras(_listed('images', images, _EACH_IMAGE),
                           _listed('cameras', cameras, _EACH_CAMERA), options)
    if size is not None and unit != 1:
        raise ConfigError('size and unit both set the scale: give one of them')
    if isinstance(images, Path | str):
        place: Path | list[Path] = Path(images)
    else:
        images = _listed('images', images, _EACH_IMAGE)
        place = [Path(image) for image in images if isinstance(image, Path | str)]
        if len(place) != len(images):
            raise ConfigError('cameras: expected a camera for each image, since pixels have no '
                              'names to find them by in a file')
    return from_files(place, cameras, options)


def from_files(place: Path | Sequence[Path], source: Source | None, options: Options = _DEFAULTS,
               reporting: Reporting = silent) -> Shape:
    """
    Reconstruct from photos, a folder, a video or files, whose cameras are found as in `posed_by`.

    By structure from motion no scale is known: without a size the cube's side is 1 m, which a
    warning says. Raises ActiveReconError where no photo can be used.
    """
    if is_video(place):
        require_found(source, options.masks)
        warnings: list[str] = []
        with frames_of(place, options.frames, reporting, warnings.append) as folder:
            shape = from_files(folder, source, options, reporting)
        return replace(shape, warnings=[*warnings, *shape.warnings])
    is_scaled = not isinstance(source, SfmCameras) or options.size is not None
    if isinstance(source, SfmCameras):
        _require_no_lengths(options)
        options = replace(options, size=options.size or 1.0)
    photos, left_out = open_photos(photo_paths(place))
    with _telling(left_out):
        ordered = in_order_of(options.order, photos)
        if isinstance(source, TurntableCameras) and left_out and ordered != photos:
            raise DataError('order: the place of a photo that is left out is unknown: expected '
                            'all photos of a turntable, or names in their order', 'no_time')
        photos = ordered
        file, posed, unposed = posed_by(source, photos, options.axes, reporting)
        left_out += unposed
        chosen = even_choice(posed, options.views or len(posed))
        with reporting('reading the photos', len(chosen)) as advance:
            views, unread = load_views(chosen, options.masks, advance)
        left_out += unread
        shape = from_views(views, file, options, left_out, reporting)
    return shape if is_scaled else replace(shape, warnings=[*shape.warnings, _NO_SCALE])


def _require_no_lengths(options: Options) -> None:
    """Raise ConfigError on lengths in units of cameras that are not found yet."""
    if options.box is not None or options.unit != 1:
        raise ConfigError('box or unit with structure from motion: the unit of the cameras that '
                          "it finds is arbitrary; expected size, the object's longest side in "
                          'metres')


@contextmanager
def _telling(left_out: Sequence[str]) -> Iterator[None]:
    """Let an error of the photos say which were left out before it."""
    try:
        yield
    except DataError as error:
        if not left_out or isinstance(error, WeightsError):
            raise
        raise DataError(f'{error}. Left out before, {len(left_out)}: {"; ".join(left_out[:3])}',
                        error.kind) from error


def from_views(views: Sequence[PhotoView], file: CameraFile, options: Options = _DEFAULTS,
               left_out: Sequence[str] = (), reporting: Reporting = silent,
               reconstructor: Reconstructor | None = None) -> Shape:
    """
    Reconstruct from photos in memory, whose cameras are of `file`'s world.

    `reconstructor` is one of the options' model that is already loaded; None: it is loaded here.
    """
    if file.metric and options.box is not None and options.size not in (None, options.box[3]):
        raise ConfigError(f'box and size: both in metres with a {file.source}: expected one of '
                          f'them, got sides of {options.box[3]:g} and {options.size:g} m')
    reconstructor = reconstructor or load(options.model, threads=options.threads)
    poses = [view.camera for view in views]
    told = axis_direction(options.up) if options.up else file.up
    up = told if told is not None else upward(
        file.as_seen or [entry.pose for entry in file.entries]
        or [camera.pose for camera in poses])
    cube = _told_cube(options, file, up)
    wrong = misreading(poses, None if cube is None else cube.centre, file.looks)
    if wrong:
        raise DataError(f'{file.source}: {wrong}', 'convention')
    views, empty, cube = _separated(views, file, cube, options.background)
    background = options.background
    if background == 'auto' and before_clutter(views):
        background, views = 'segment', [
            replace(view, mask=None, mask_source='') for view in views]
    with reporting('finding the object', 1) as advance:
        start = cube or first_cube(poses, up, WIDER if are_masked(views) else NARROWER)
        ground = _ground(views, file, start, options.ground)
        if ground is not None and told is None:
            start = replace(start, up=ground.normal)
        cube = start if cube is not None else found_cube(
            views, start, reconstructor, background, ground)
        advance(1, '')
    if options.size and file.metric and options.box is None:
        cube = replace(cube, side=options.size)
        cube = cube if file.board is None else BOARD_GROUND.under(cube)
    shown = views
    if background == 'segment':
        shown, unfound = segmented_views(
            views, cube, shipped_segmentation(reconstructor.threads), ground)
        empty = [*empty, *unfound]
        if not shown:
            raise DataError(f'object not found: {empty[0]}{no_table(ground)}', 'no_object')
    size = options.size or cube.side * options.unit
    with reporting('reconstructing', len(views)) as advance:
        taken, unseen = integrate(shown, cube, size, reconstructor, background, advance,
                                  with_depth=True)
    known = taken[-1].known.grid
    grid, covered = carved(known, reconstructor.threshold, views, cube)
    if grid is known:
        taken = [replace(view, background=uncut(view.background)) for view in taken]
    if ground is not None:
        grid = above_ground(grid, reconstructor.threshold, cube, ground)
    return Shape(grid, reconstructor.threshold, taken, cube, ground,
                 named([view.background for view in taken]), [*left_out, *empty, *unseen],
                 [*unknown_front(reconstructor),
                  *doubts(taken, views, cube, reconstructor, background, covered,
                          file.looks), *better_box(taken, cube, reconstructor.threshold),
                  *_without_depth(views, taken),
                  *filter(None, [reconstructor.provenance.get(REMARK)])],
                 dict(reconstructor.provenance))


def _ground(views: Sequence[PhotoView], file: CameraFile, start: Cube,
            searched: bool) -> Ground | None:
    """Return what the object stands on: the board, or a table if it is `searched` and found."""
    if file.board is not None:
        return BOARD_GROUND
    if not searched:
        return None
    return found_ground(views, start.centre, start.up)


def _without_depth(views: Sequence[PhotoView], taken: Sequence[TakenView]) -> list[str]:
    """Return why depth images were not used, one line each."""
    refusals = [(view.name, view.depth_refusal) for view in views]
    refusals += [(view.name, view.known.depth_refusal) for view in taken]
    return [f'{name}: without its depth: {refusal}' for name, refusal in refusals if refusal]


def _listed(name: str, given: Iterable[T], each: str) -> list[T]:
    """Return what was given as a list; raises ConfigError where there is nothing to go through."""
    try:
        return list(given)
    except TypeError as error:
        raise ConfigError(f'{name}: expected a list with {each}, got {type(given).__name__}'
                          ) from error


def _of_cameras(images: Sequence[object], cameras: Sequence[Camera], options: Options) -> Shape:
    if options.size is None:
        raise ConfigError("size: missing: expected the side of the object's cube in metres, "
                          'about the origin of the frame that the cameras are in')
    for name, given, instead in (
            ('masks', options.masks is not None, 'give pixels with an alpha channel'),
            ('unit', options.unit != 1, 'give cameras in metres'),
            ('order', options.order != 'name', 'give the images in their order'),
            ('axes', options.axes is not None, 'give poses of the optical frame')):
        if given:
            raise ConfigError(f'{name}: not for images with cameras of their own: {instead}')
    for each in cameras:
        if not isinstance(each, Camera):
            raise ConfigError(f'cameras: expected a list with {_EACH_CAMERA}, got '
                              f'{type(each).__name__} in it')
    if len(images) != len(cameras) or len(images) == 0:
        raise ConfigError(f'cameras: expected one for each of {len(images)} images, got '
                          f'{len(cameras)}')
    views, left_out = [], []
    for number, (image, camera) in enumerate(zip(images, cameras, strict=True), 1):
        if not isinstance(image, np.ndarray):
            raise ConfigError(f'image {number}: expected pixels, (H, W, 3) uint8 RGB, for a '
                              f'camera of its own, got {type(image).__name__}')
        try:
            views.append(view_of(f'image {number}', image, camera))
        except DataError as error:
            left_out.append(str(error))
    if not views:
        raise DataError(f'no photo can be used: {"; ".join(left_out[:3])}', 'no_photos')
    file = CameraFile('cameras', (), np.array([0.0, 0.0, 1.0]))
    box = (0.0, 0.0, 0.0, options.size) if options.box is None else options.box
    # Their own, so that a buffer that is filled anew changes no colour of a mesh to come
    own = [replace(view, image=view.image.copy())
           for view in even_choice(views, options.views or len(views))]
    with _telling(left_out):
        return from_views(own, file, replace(options, box=box), left_out)


def _separated(views: Sequence[PhotoView], file: CameraFile, cube: Cube | None, background: str
               ) -> tuple[list[PhotoView], list[str], Cube | None]:
    """
    Return the views that are not empty with their masks, why others are left out, and the cube.

    Without a cube, what stands on a board is searched above and around it, and found with it.
    """
    if file.board is not None and background == 'auto' and all(
            view.mask is None for view in views):
        return board_views(views, file.board, cube)
    found, left_out = [], []
    for view in views:
        try:
            found.append(separated(view, background))
        except ViewError as error:
            left_out.append(f'{view.name}: {error}')
    if not found:
        raise DataError(f'object not found: {left_out[0]}', 'no_object')
    return found, left_out, cube


def _told_cube(options: Options, file: CameraFile, up: NDArray[np.float64]) -> Cube | None:
    """Return the cube of the options or the file, None where neither has one."""
    if options.box is not None:
        *centre, side = options.box
        return Cube(np.array(centre, np.float64), side, up)
    return None if file.box is None else Cube.around(file.box, up)
