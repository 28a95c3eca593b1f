"""Photos on white by the segmenter, and by what all photos agree on."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.resampling import carried_back
from active_recon.photos.cube import Cube
from active_recon.photos.ground import Ground
from active_recon.photos.seen_photo import SeenPhoto
from active_recon.photos.silhouette_fusion import CELLS, segmented_silhouettes
from active_recon.photos.table_evidence import above_table
from active_recon.photos.views import PhotoView
from active_recon.segmentation import FramedShares, on_white_by, Segmentation
import numpy as np
from numpy.typing import NDArray

_UNIT_CUBE = Cube(np.zeros(3), 1.0, np.array([0.0, 0.0, 1.0]))
_UNKNOWN = np.float32(0.5)  # the object's share of pixels that no photo has


def segmented_views(views: Sequence[PhotoView], cube: Cube, segmentation: Segmentation,
                    ground: Ground | None = None) -> tuple[list[PhotoView], list[str]]:
    """
    Return views on white by what all of them agree is the object, and why others are left out.

    Edges and what is in doubt are in between. Nothing under a ground is the object.
    """
    found, left_out = [], []
    for view in views:
        try:
            found.append((view, segmentation.framed(view.image, cube.camera(view.camera, 1.0))))
        except ViewError as error:
            left_out.append(f'{view.name}: {error}')
    agreed = agreed_shares([framed for _, framed in found], _within(ground, cube))
    shown = []
    for (view, framed), share in zip(found, agreed, strict=True):
        if share.max() <= _UNKNOWN:
            left_out.append(f'{view.name}: the other photos see no object where the segmenter '
                            'found one')
            continue
        whole = carried_back(share, framed.camera, cube.camera(view.camera, 1.0))
        shown.append(replace(view, image=on_white_by(whole, view.image), mask=None,
                             mask_source='segmenter'))
    return shown, left_out


def segmented_cells(views: Sequence[PhotoView], cube: Cube, segmentation: Segmentation,
                    ground: Ground | None = None
                    ) -> tuple[NDArray[np.bool_], list[NDArray[np.bool_]], list[Camera]]:
    """
    Return the cells of a cube, (C, C, C), that the views agree are the object.

    Beside them the masks that they agree on, (S, S) each, and their cameras in sides of the cube.
    """
    found = []
    for view in views:
        with suppress(ViewError):
            found.append(segmentation.framed(view.image, cube.camera(view.camera, 1.0)))
    if not found:
        return np.zeros((CELLS,) * 3, np.bool_), [], []
    shares, cells = _agreed(found, _within(ground, cube))
    return cells, [share > _UNKNOWN for share in shares], [each.camera for each in found]


def agreed_shares(framed: Sequence[FramedShares], table: Ground | None = None
                  ) -> list[NDArray[np.float32]]:
    """
    Return the object's share in each pixel, (S, S) each, that framed images agree on.

    `table` is what the object stands on, in the object frame, lengths in sides of the cube.
    """
    return _agreed(framed, table)[0] if framed else []


def seen_photo(framed: FramedShares) -> SeenPhoto:
    """Return a framed image without its shares; what the camera saw of it is `known`."""
    image = framed.image[..., :3].astype(np.float32)
    seen = (np.full(image.shape[:2], True) if framed.image.shape[2] == 3
            else framed.image[..., 3] > 127)
    return SeenPhoto(framed.camera, image, image, seen, np.zeros_like(image))


def _within(ground: Ground | None, cube: Cube) -> Ground | None:
    return None if ground is None else ground.within(cube)


def _agreed(framed: Sequence[FramedShares], table: Ground | None
            ) -> tuple[list[NDArray[np.float32]], NDArray[np.bool_]]:
    """Return the shares and the cells, (C, C, C), that framed images agree on."""
    photos = [seen_photo(each) for each in framed]
    above = evidence = None
    if table is not None:
        above = table.above(_UNIT_CUBE, CELLS)
        evidence = above_table(photos, table)
    return segmented_silhouettes(photos, [each.shares for each in framed], above, evidence)
