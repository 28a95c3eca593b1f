"""Photos in memory: pixels, mask and camera of each, in the world of the camera file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from active_recon.errors import DataError
from active_recon.file_names import comparable
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.photos.camera_file import PosedPhoto
from active_recon.photos.depth_files import depth_files, read_depth
from active_recon.photos.files import read_photo
from active_recon.photos.formats import ENDINGS
from active_recon.photos.large_images import opened
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

T = TypeVar('T')
_SEE_THROUGH = 250  # alpha below which a photo has an alpha channel worth the name
_EMPTY_SHARE = 0.02
_FULL = (1, 255, 65535)  # the object in masks of labels, of 8 and of 16 bits
_QUARTER_TURNS = {3: 2, 6: 1, 8: 3}  # counter-clockwise, which take back those of EXIF


@dataclass(frozen=True, eq=False)
class PhotoView:
    """
    A photo and its camera.

    - image: (H, W, 3) uint8 RGB; mask: (H, W) bool, true on the object, or None
    - mask_source: 'masks' (files), 'alpha', or '' without a mask; 'segmenter' where the image is
      on white by one
    - camera: pose world from optical frame, in the units of the camera file
    - depth: (H, W) metres along the optical axis, 0 where there is no value, or None;
      depth_refusal: why there is none although there is a file, else ''
    """

    name: str
    image: NDArray[np.uint8]
    camera: Camera
    mask: NDArray[np.bool_] | None = None
    mask_source: str = ''
    depth: NDArray[np.float32] | None = None
    depth_refusal: str = ''


def load_views(posed: Sequence[PosedPhoto], masks: Path | None = None,
               advance: Callable[[int, str], None] = lambda steps, note: None
               ) -> tuple[list[PhotoView], list[str]]:
    """
    Read photos with their masks and depth, and return why others are left out.

    `masks` is a folder with a mask for each photo, of the same name or stem, bright on the
    object. Raises DataError where no photo is left, or the folder has no mask for any.
    """
    known = _masks_by_stem(masks)
    depths = depth_files([each.photo.path for each in posed])
    views, left_out = [], []
    for each in posed:
        try:
            views.append(_with_depth(_view(each, known),
                                     each.depth or depths.get(each.photo.path), each))
        except DataError as error:
            left_out.append(str(error))
        advance(1, each.photo.name)
    if not views:
        raise DataError(f'no photo can be used: {"; ".join(left_out[:3])}', 'no_photos')
    require_masks(views, masks)
    return views, left_out


def load_view(posed: PosedPhoto, masks: Path | None = None) -> PhotoView:
    """Read one photo with its mask, if it has one, and its depth; raises DataError."""
    depth = posed.depth or depth_files([posed.photo.path]).get(posed.photo.path)
    return _with_depth(_view(posed, _masks_by_stem(masks)), depth, posed)


def require_masks(views: Sequence[PhotoView], masks: Path | None) -> None:
    """Raise DataError where a folder of masks has none for any of the photos."""
    if masks is not None and not any(view.mask_source == 'masks' for view in views):
        raise DataError(f'{masks}: masks of other photos: expected some named like '
                        f'{views[0].name}, found none of {len(_masks_by_stem(masks))}',
                        'no_masks')


def view_of(name: str, image: NDArray[np.uint8], camera: Camera) -> PhotoView:
    """
    Return the view of pixels in memory: (H, W, 3) uint8 RGB, or (H, W, 4) with straight alpha.

    Raises DataError on other pixels, and where they are not of the camera's size.
    """
    lens = camera.intrinsics
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4) or (
            image.shape[:2] != (lens.height, lens.width)):
        raise DataError(f'{name}: wrong image: expected {lens.height} x {lens.width} x 3 or 4 '
                        f'uint8, as the camera says, got {image.shape} {image.dtype}')
    alpha = image[..., 3] if image.shape[2] == 4 else None
    image = np.ascontiguousarray(image[..., :3])
    if alpha is None or (alpha < _SEE_THROUGH).mean() < _EMPTY_SHARE:
        return PhotoView(name, image, camera)
    if not (alpha > 127).any():
        raise DataError(f'{name}: empty: expected an object in its alpha channel, got none')
    return PhotoView(name, image, camera, alpha > 127, 'alpha')


def with_camera(view: PhotoView, posed: PosedPhoto) -> PhotoView:
    """Return the view of a photo whose camera has become known better."""
    height, width = view.image.shape[:2]
    return replace(view, camera=Camera(posed.pose, _reduced(posed.intrinsics, width, height)))


def _view(posed: PosedPhoto, masks: dict[str, Path]) -> PhotoView:
    pixels = read_photo(posed.photo, posed.upright)
    height, width = pixels.shape[:2]
    camera = Camera(posed.pose, _reduced(posed.intrinsics, width, height))
    name = posed.photo.name
    view = view_of(name, pixels, camera)
    path = masks.get(comparable(Path(name).stem))
    if path is None:
        return view
    try:
        mask = _mask(path, width, height, partial(_turned_back, posed, width, height))
    except DataError as error:
        raise DataError(f'{name}: {error}') from error
    return PhotoView(name, view.image, camera, mask, 'masks')


def _turned_back(posed: PosedPhoto, width: int, height: int,
                 values: NDArray[Any]) -> NDArray[Any]:
    """
    Return a mask or depth, (H, W), turned as its photo of `width` x `height` was read.

    It belongs to the photo as EXIF turns it, unless only the photo as stored has its shape.
    """
    turns = 0 if posed.upright else _QUARTER_TURNS.get(posed.photo.orientation, 0)
    if turns % 2 and not _has_shape(values, height, width):
        return values
    return np.rot90(values, turns)


def _has_shape(values: NDArray[Any], width: int, height: int) -> bool:
    """Return whether values, (H, W), are as high for their width as a photo of that size."""
    rows, columns = values.shape
    return bool(abs(columns * height - width * rows) <= 0.01 * width * rows)


def _with_depth(view: PhotoView, path: Path | None, posed: PosedPhoto) -> PhotoView:
    if path is None:
        return view
    height, width = view.image.shape[:2]
    try:
        return replace(view, depth=read_depth(
            path, width, height, partial(_turned_back, posed, width, height)))
    except DataError as error:
        return replace(view, depth_refusal=str(error))


def _reduced(lens: Intrinsics, width: int, height: int) -> Intrinsics:
    return lens if (lens.width, lens.height) == (width, height) else lens.resized(width, height)


def _masks_by_stem(folder: Path | None) -> dict[str, Path]:
    if folder is None:
        return {}
    if not folder.is_dir():
        raise DataError(f'{folder}: no such folder: expected one with masks', 'no_masks')
    # nerfstudio and COLMAP name the mask of a.jpg a.jpg.png
    return {comparable(Path(path.stem).stem if Path(path.stem).suffix.lower() in ENDINGS
                       else path.stem): path
            for path in sorted(folder.iterdir()) if path.suffix.lower() in ENDINGS}


def _brightness(image: Image.Image) -> NDArray[np.float32]:
    """
    Return a mask's values, (H, W): its alpha channel unless that is opaque, else its brightness.

    That of a colour, as masks of labels have, is its brightest channel's.
    """
    if image.mode.startswith(('I', 'F')):  # 16 bits, 32, or floats
        return np.asarray(image, np.float32)
    if image.has_transparency_data:
        alpha = image.convert('RGBA').getchannel('A')
        if alpha.getextrema() != (255, 255):
            return np.asarray(alpha, np.float32)
    return np.asarray(np.asarray(image.convert('RGB')).max(axis=2), np.float32)


def _mask(path: Path, width: int, height: int,
          turned: Callable[[NDArray[Any]], NDArray[Any]] = lambda stored: stored
          ) -> NDArray[np.bool_]:
    try:
        with opened(path) as image:
            grey = _brightness(image)
    except DataError as error:
        raise DataError(f'{path}: no mask: expected an image, got: {error}') from error
    grey = turned(grey)
    if not _has_shape(grey, width, height):
        raise DataError(f'{path}: no mask of the right size: expected {width} x {height} pixels '
                        f'or the same shape, got {grey.shape[1]} x {grey.shape[0]}')
    full = next((most for most in _FULL if grey.max() <= most), _FULL[-1])
    sized = cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA)
    found = np.asarray(sized > full / 2)
    if not found.any():
        raise DataError(f'{path}: empty mask: expected an object, brighter than {full / 2:g} of '
                        f'{full}, got at most {grey.max():g}')
    return found


def even_choice(views: Sequence[T], count: int) -> list[T]:
    """Return so many views at even steps, in their order; all where there are no more."""
    if count >= len(views):
        return list(views)
    return [views[step * len(views) // count] for step in range(count)]
