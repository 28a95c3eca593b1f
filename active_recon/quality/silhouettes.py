"""The silhouettes that a reconstruction predicts, beside those that the network saw."""

from dataclasses import dataclass
from functools import cached_property

from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SeenView:
    """
    What the network saw of a view.

    - camera: of the network's image; lengths in sides of the grid
    - foreground: (S, S) in [0, 1], the probability that a pixel shows the object
    - seen: (S, S) in [0, 1], the share of each pixel that the camera's image holds
    """

    camera: Camera
    foreground: NDArray[np.float32]
    seen: NDArray[np.float32]

    @cached_property
    def sized_camera(self) -> Camera:
        """The camera of an image of S x S pixels."""
        side = len(self.foreground)
        return Camera(self.camera.pose, self.camera.intrinsics.resized(side, side))

    @cached_property
    def known(self) -> Mask:
        """The pixels of S x S that the camera's image holds."""
        return np.asarray(self.seen > 0.5)

    @cached_property
    def shown(self) -> Mask:
        """The known pixels that show the object."""
        return (self.foreground > 0.5) & self.known

    @cached_property
    def outline(self) -> Mask:
        """The known pixels whose rays meet the cube."""
        return cube_outline(self.sized_camera) & self.known

    @cached_property
    def within(self) -> Mask:
        """The pixels that show the object within the outline."""
        return self.shown & self.outline

    @cached_property
    def shares(self) -> tuple[float, float, float]:
        """What of `Agreement` no reconstruction changes: outside, unsure and filled."""
        doubt = (np.abs(self.foreground - 0.5) < 0.3) & self.outline
        return (_share(self.shown & ~self.outline, self.shown), _share(doubt, self.outline),
                _share(self.within, self.outline))


@dataclass(frozen=True)
class Agreement:
    """
    How a predicted silhouette and the foreground that was seen agree, each in [0, 1].

    - iou: of the two, on the pixels that the camera saw; 1 where both are empty
    - missed: share of the foreground within the cube's outline that the reconstruction leaves out
    - extra: share of the predicted silhouette where no foreground was seen
    - outside: share of the foreground that lies outside of the cube's outline
    - unsure: share of the cube's outline whose foreground is in doubt (0.2 to 0.8)
    - filled: share of the cube's outline that is foreground
    """

    iou: float
    missed: float
    extra: float
    outside: float
    unsure: float
    filled: float


def eroded(cells: Mask) -> Mask:
    """
    Return the cells (R, R, R) all of whose six neighbours are there too.

    This is what scipy's `binary_erosion` returns, in a fiftieth of its time: every view needs it.
    """
    left = np.array(cells, order='C')
    kept, own = left.reshape(-1), cells.ravel()
    # Also from the end of a row to the begin of the next one: neither stays
    for step in (1, cells.shape[2], cells.shape[1] * cells.shape[2]):
        kept[step:] &= own[:-step]
        kept[:-step] &= own[step:]
    for end in (0, -1):  # nothing is outside of the grid
        left[end] = left[:, end] = left[:, :, end] = False
    return left


def silhouette(points: NDArray[np.float64], camera: Camera) -> Mask:
    """
    Return the pixels that points (N, 3) project onto, (height, width).

    It is the silhouette of a shape if the points are the centres of its surface cells and at most
    a pixel apart, as 64 cells a side are in an image of 64 pixels that holds the whole cube.
    """
    lens = camera.intrinsics
    mask = np.zeros(lens.height * lens.width, np.bool_)
    pixels, depth = camera.project(points)
    x, y = pixels.T
    inside = (depth > 0) & (x >= 0) & (x < lens.width) & (y >= 0) & (y < lens.height)
    if not inside.all():
        x, y = x[inside], y[inside]
    mask[y.astype(np.intp) * lens.width + x.astype(np.intp)] = True
    return mask.reshape(lens.height, lens.width)


def cube_outline(camera: Camera) -> Mask:
    """Return the pixels whose rays meet the unit cube about the origin, (height, width)."""
    rays = np.ascontiguousarray(np.moveaxis(camera.ray_directions(), -1, 0))
    position = camera.position[:, None, None]
    with np.errstate(divide='ignore', invalid='ignore'):
        near, far = ((side - position) / rays for side in (-0.5, 0.5))
    # A ray in the plane of a face is NaN there: the opposite face, which it misses, counts
    enter, leave = np.fmin(near, far).max(axis=0), np.fmax(near, far).min(axis=0)
    return np.asarray((enter <= leave) & (leave > 0))


def agreement(points: NDArray[np.float64], view: SeenView) -> Agreement:
    """Compare the silhouette of a shape's surface points (N, 3) with what a view showed."""
    predicted, within = silhouette(points, view.sized_camera) & view.known, view.within
    outside, unsure, filled = view.shares
    return Agreement(
        iou=_share(predicted & within, predicted | within, 1.0),
        missed=_share(within & ~predicted, within),
        extra=_share(predicted & ~view.shown, predicted),
        outside=outside, unsure=unsure, filled=filled)


def _share(part: Mask, whole: Mask, empty: float = 0.0) -> float:
    count = np.count_nonzero(whole)
    return np.count_nonzero(part) / count if count else empty
