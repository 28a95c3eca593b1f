"""What is behind the object in a photo, and what of it the network is shown."""

from collections.abc import Sequence
from dataclasses import replace

from active_recon.acquisition.background import COLOR_TOLERANCE, on_white
from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.framing import cube_corners
from active_recon.photos.matting import rembg_mask
from active_recon.photos.views import PhotoView
from active_recon.segmentation import shipped_segmentation
import cv2
import numpy as np
from numpy.typing import NDArray

BACKGROUNDS = ('auto', 'plain', 'network', 'segment', 'grabcut', 'rembg')
"""
`auto`: the object on white by its mask from a file or alpha channel; without one as `network`,
and where the background is plain, cells that only show it are cut off; where no photo has a mask
and few have a plain background, as `segment`. `plain`: on white by the colour of a plain
background. `network`: the photo as it is, of which the network finds the silhouette itself.
`segment`: on white by the segmenter that ships and by what all photos agree on. `grabcut`: on
white by GrabCut, begun from the projected cube. `rembg`: on white by the package of that name.
"""
_FRAME = 0.0125  # width of the photo's edge that is looked at, relative to its longer side
_PLAIN_SHARE = 0.75  # of the edge: the object may reach over the rest
_CLOSED = 0.011  # width of gaps in the object that are closed, relative to the longer side
_SEARCHED_SIDE = 192
_ROUNDS = 3
_LEAST_SHARE, _MOST_SHARE = 0.02, 0.98


def separated(view: PhotoView, background: str) -> PhotoView:
    """
    Return the view with the mask that a background asks for before the cube is known.

    Raises ConfigError on an unknown background, ViewError where there is nothing before a plain
    one, or rembg finds nothing.
    """
    if background not in BACKGROUNDS:
        raise ConfigError(f'background: unknown value: expected one of {", ".join(BACKGROUNDS)}, '
                          f'got {background!r}')
    if background == 'auto' and view.mask is not None:
        return view
    view = replace(view, mask=None, mask_source='')
    if background == 'rembg':
        return replace(view, mask=rembg_mask(view.image), mask_source='rembg')
    if background not in ('auto', 'plain'):
        return view
    mask = off_plain(view.image)
    return view if mask is None else replace(view, mask=mask, mask_source='plain')


def before_clutter(views: Sequence[PhotoView]) -> bool:
    """
    Return whether separated views need a segmenter: no mask is known, and most are not plain.

    A few photos of any room happen to have an edge of one colour.
    """
    return (all(view.mask_source in ('', 'plain') for view in views)
            and sum(view.mask_source == 'plain' for view in views) < len(views) / 2)


def off_plain(image: NDArray[np.uint8]) -> NDArray[np.bool_] | None:
    """
    Return the mask, (H, W), of what differs from the colour along the image's edge, (H, W, 3).

    Narrow gaps are closed, since shadows on an object can have the background's colour. None
    where the edge has no single colour, or nearly everything differs from it. Raises ViewError
    where nothing does.
    """
    longer = max(image.shape[:2])
    lab = cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0.6).astype(np.float32) / 255,
                       cv2.COLOR_RGB2Lab)
    width = max(1, round(_FRAME * longer))
    edge = np.ones(image.shape[:2], np.bool_)
    edge[width:-width, width:-width] = False
    apart = np.linalg.norm(lab - np.median(lab[edge], axis=0), axis=2)
    if (apart[edge] <= COLOR_TOLERANCE).mean() < _PLAIN_SHARE:
        return None
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(_CLOSED * longer) + 1,) * 2)
    found = np.asarray(cv2.morphologyEx((apart > COLOR_TOLERANCE).astype(np.uint8),
                                        cv2.MORPH_CLOSE, disc) > 0)
    if found.mean() < _LEAST_SHARE / 10:
        raise ViewError('no object: expected one before the plain background, found nothing that '
                        'differs from its colour', 'no_object')
    return found if found.mean() < _MOST_SHARE else None


def shown_image(view: PhotoView, camera: Camera, size: float, background: str,
                threads: int | None = None) -> tuple[NDArray[np.uint8], str]:
    """
    Return the photo as the network is shown it, (H, W, 3) uint8 RGB, and what removed its back.

    `camera` is the view's in the object frame, `size` the side of the cube there, `threads` are
    those of a segmenter. The second is 'masks', 'alpha', 'board', 'plain', 'rembg', 'segmenter',
    'grabcut', or 'network' where nothing was removed, 'network and plain' where what only shows a
    plain background will be cut off.
    """
    if view.mask_source == 'plain' and background == 'auto':
        return view.image, 'network and plain'
    if view.mask is not None:
        return on_white(view.image, view.mask), view.mask_source
    if view.mask_source == 'segmenter':  # on white since all photos were looked at
        return view.image, 'segmenter'
    if background == 'segment':
        return shipped_segmentation(threads).on_white(view.image, camera, size), 'segmenter'
    if background == 'grabcut':
        found = grabcut(view.image, camera, size)
        if found is not None:
            return on_white(view.image, found), 'grabcut'
    return view.image, 'network'


def grabcut(image: NDArray[np.uint8], camera: Camera, size: float) -> NDArray[np.bool_] | None:
    """
    Return the object's mask, (H, W), found by GrabCut; None where it finds no two colours.

    What lies outside of the projected cube of side `size` is background for certain, what is
    inside may be either. Rother et al., "GrabCut", SIGGRAPH 2004.
    """
    height, width = image.shape[:2]
    shrink = min(1.0, _SEARCHED_SIDE / max(height, width))
    small = cv2.resize(image, (max(1, round(width * shrink)), max(1, round(height * shrink))),
                       interpolation=cv2.INTER_AREA)
    inside = cube_pixels(camera, size, (small.shape[1], small.shape[0]))
    share = inside.mean()
    if not _LEAST_SHARE < share < _MOST_SHARE:
        return None
    labels = np.where(inside, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    cv2.grabCut(np.ascontiguousarray(small[..., ::-1]), labels, (0, 0, 1, 1), *models, _ROUNDS,
                cv2.GC_INIT_WITH_MASK)  # which ignores the rectangle
    found = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
    if not _LEAST_SHARE * share < found.mean():
        return None
    whole = cv2.resize(found * np.uint8(255), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole > 127)


def cube_pixels(camera: Camera, size: float, pixels: tuple[int, int]) -> NDArray[np.bool_]:
    """
    Return the projected cube of side `size` in an image of (width, height), (height, width) bool.

    Raises ViewError where the camera is in the cube.
    """
    scaled = Camera(camera.pose, camera.intrinsics.resized(*pixels))
    corners, depth = scaled.project(cube_corners() * size)
    if depth.min() <= 0:
        raise ViewError("camera in the object's cube: expected one outside of it", 'out_of_image')
    hull = cv2.convexHull(corners.astype(np.float32))
    drawn = np.zeros(pixels[::-1], np.uint8)
    cv2.fillConvexPoly(drawn, np.rint(hull).astype(np.int32), 1)
    return np.asarray(drawn > 0)


def uncut(source: str) -> str:
    """Return what removed a photo's back, see `shown_image`, where no cell was cut off by it."""
    return 'network' if source == 'network and plain' else source


def named(sources: Sequence[str]) -> str:
    """Return in words where the silhouettes of all photos are from."""
    words = {'masks': 'masks from files', 'alpha': 'alpha channels',
             'board': 'what covers the printed board',
             'plain': "the plain background's colour", 'segmenter': 'the segmenter',
             'grabcut': 'GrabCut', 'rembg': "rembg's masks",
             'network and plain': "the network's own silhouettes, cut by a plain background's "
             'colour', 'network': "the network's own silhouettes"}
    counts = {source: sources.count(source) for source in words if source in sources}
    return ', '.join(words[source] if len(counts) == 1 else f'{words[source]} ({count})'
                     for source, count in counts.items())
