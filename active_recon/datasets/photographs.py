"""Photographs as single-view objects: cropped, on white, at the canonical camera's scale."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.views import ViewSet
from active_recon.errors import ActiveReconError, DataError
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, orbit_camera
from active_recon.models.encoder import IMAGE_SIZE
from active_recon.models.network import Cameras
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import RESOLUTION
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
import torch

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Photograph:
    """
    One object in one photograph.

    - item: its category and name; image: the photograph's file
    - box: left, top, right, bottom, in pixels from the image's corner
    - azimuth, elevation: of the camera in the object frame, radians
    - cad: the file of its CAD model; up, front: the axes of that file that point up and forward
    """

    item: ObjectFolder
    image: Path
    box: Box
    azimuth: float
    elevation: float
    cad: Path
    up: str
    front: str


def read_photographs(photographs: Sequence[Photograph], left_out: Sequence[str] = (),
                     progress: Callable[[], None] = lambda: None,
                     resolution: int = RESOLUTION) -> ViewSet:
    """
    Read photographs as objects of one view each, V = 1, with the voxels of their CAD models.

    Each is cropped to its box, scaled and moved to where the canonical camera would show its CAD
    model from the annotated direction, on white. `left_out` and the errors of those that cannot
    be read become the set's `unreadable`. Raises DataError if none can be read.
    """
    models: dict[Path, _Model | str] = {}
    images, voxels, good, unreadable = [], [], [], list(left_out)
    for photograph in photographs:
        try:
            if photograph.cad not in models:
                models[photograph.cad] = _read_model(photograph, resolution)
            model = models[photograph.cad]
            if isinstance(model, str):
                raise DataError(model)
            images.append(_cut_out(_read_picture(photograph.image), photograph.box,
                                   _shown_at(model.corners, photograph)))
            voxels.append(model.voxels)
            good.append(photograph)
        except ActiveReconError as error:
            unreadable.append(f'{photograph.item.name}: {error}')
        progress()
    if not good:
        raise DataError('no readable photograph: expected at least one, got none'
                        + ''.join(f'\n  {reason}' for reason in unreadable[:5]))
    cameras = Cameras.of([_canonical_camera(photograph) for photograph in good])
    return ViewSet(torch.from_numpy(np.stack(images))[:, None], cameras.poses[:, None],
                   cameras.intrinsics[:, None],
                   torch.from_numpy(np.stack(voxels)),
                   tuple(photograph.item for photograph in good), tuple(unreadable))


@dataclass(frozen=True, eq=False)
class _Model:
    corners: NDArray[np.float64]
    voxels: NDArray[np.bool_]


def _read_model(photograph: Photograph, resolution: int) -> _Model | str:
    """Return a CAD model, or the error in reading it, which holds for all its photographs."""
    try:
        mesh = load_mesh(photograph.cad, photograph.up, photograph.front)
    except DataError as error:
        return str(error)
    return _Model(np.asarray(mesh.vertices), voxelise(mesh, resolution).occupied(0.5))


def _read_picture(path: Path) -> NDArray[np.uint8]:
    """Return an image, (H, W, 3) RGB; unlike OpenCV, Pillow reports a truncated file."""
    try:
        with Image.open(path) as image:
            return np.asarray(image.convert('RGB'))
    except (OSError, SyntaxError) as error:
        raise DataError(f'{path}: unreadable image: expected a whole one, got: {error}') from error


def _canonical_camera(photograph: Photograph) -> Camera:
    lens = CANONICAL_INTRINSICS.resized(IMAGE_SIZE, IMAGE_SIZE)
    return orbit_camera(photograph.azimuth, photograph.elevation, intrinsics=lens)


def _shown_at(corners: NDArray[np.float64], photograph: Photograph) -> Box:
    """Return the box of a model in the canonical camera's image, in the network's pixels."""
    pixels = _canonical_camera(photograph).project(corners)[0]
    (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    return float(left), float(top), float(right), float(bottom)


def _cut_out(picture: NDArray[np.uint8], box: Box, place: Box) -> NDArray[np.uint8]:
    """
    Return the contents of `box` centred on `place`, (64, 64, 4) uint8, premultiplied.

    The aspect ratio is kept; the diagonal of the box is scaled to that of `place`.
    """
    height, width = picture.shape[:2]
    left, right = (min(max(round(at), 0), width) for at in box[::2])
    top, bottom = (min(max(round(at), 0), height) for at in box[1::2])
    if left >= right or top >= bottom:
        raise DataError(f'box out of the image: expected one within {width} x {height}, got {box}')
    across, down = right - left, bottom - top
    scale = math.hypot(place[2] - place[0], place[3] - place[1]) / math.hypot(across, down)
    scale = min(scale, IMAGE_SIZE / max(across, down))
    size = max(round(across * scale), 1), max(round(down * scale), 1)
    small = cv2.resize(picture[top:bottom, left:right], size,
                       interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    x, y = (min(max(round((place[axis] + place[axis + 2] - size[axis]) / 2), 0),
                IMAGE_SIZE - size[axis]) for axis in (0, 1))
    image = np.zeros((IMAGE_SIZE, IMAGE_SIZE, 4), np.uint8)
    image[y:y + size[1], x:x + size[0], :3] = small
    image[y:y + size[1], x:x + size[0], 3] = 255
    return image
