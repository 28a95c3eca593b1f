"""
The table under an object, found where its texture looks the same in all photos.

A plane is swept through the object's place, as in Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996: where it is the table, all photos show the same at its points.
Photos are compared by the correlation of small windows, which no light changes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.geometry.cameras import Camera
from active_recon.photos.cube import shown_width, upright
from active_recon.photos.ground import Ground
from active_recon.photos.integrating import SEARCHED_VIEWS
from active_recon.photos.views import even_choice, PhotoView
import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

_POINTS = 72  # of the plane in each direction
_WIDTH = 0.9  # of the part of the plane that is compared, relative to the photos' width there
_HEIGHTS = 97
_REACH = 0.45  # how far above and below the middle the plane is searched, the same
_WINDOW = 9  # points
_TEXTURE = 3.0  # grey levels, the least standard deviation of a window that tells something
_LIKE = 0.5  # correlation of a photo with the others: some have the object before the plane
_ALIKE = 0.6  # correlation above which a window is the same in those photos
_FEWEST = 3  # photos that show a window
_SHOWN = 0.8  # of the plane has to be shown by so many, with texture
_LEAST_SHARE = 0.5  # of the plane has to look alike
_OF_BEST = 0.6  # the lowest plane is taken of those that are so good beside the best
_PEAKS = 3
_APART = 5  # steps of the sweep between two peaks
_BESIDE, _LEFT = 8, 0.3  # steps beside a plane at which at most that share of it is left
_TILT = 0.03  # rad, first step of the search for the normal
_TRIES = 60
_PIXELS = 1.5  # of a photo that is compared, between two points


@dataclass(frozen=True, eq=False)
class _Plane:
    """
    A plane at a height above the middle, and how much it looks alike in the photos.

    - alike: share of its windows that do; correlation: mean of all windows, at most 1
    - shown: share of its windows that several photos show, with texture
    """

    normal: NDArray[np.float64]
    height: float
    alike: float
    correlation: float
    shown: float


def found_ground(views: Sequence[PhotoView], middle: NDArray[np.float64],
                 up: NDArray[np.float64]) -> Ground | None:
    """
    Return the textured plane that lies across `up` around or under a point, (3,); None without.

    It is searched as far as some photos show it around the point, a few degrees off `up`. Of
    several planes, such as a table and the lid of a box, the lowest counts: too low a plane costs
    less than one that cuts the object. There is none where texture is so coarse that planes
    beside it look alike, too, or where a camera looks from below.
    """
    if len(views) < _FEWEST:
        return None
    some = even_choice(views, SEARCHED_VIEWS)
    width = float(np.median([shown_width(view.camera, middle) for view in some]))
    photos = [_reduced(view, middle, width) for view in some]
    step = 2 * _REACH * width / (_HEIGHTS - 1)

    def compared(normal: NDArray[np.float64], height: float) -> _Plane:
        return _compared(photos, middle, width, normal, height)

    planes = _peaks(compared, up / np.linalg.norm(up), step)
    best = max((plane.alike for plane in planes), default=0.0)
    planes = [plane for plane in planes if plane.alike >= max(_LEAST_SHARE, _OF_BEST * best)]
    if not planes:
        return None
    lowest = min(planes, key=lambda plane: plane.height)
    beside = np.mean([compared(lowest.normal, lowest.height + apart * step).alike
                      for apart in (-_BESIDE, _BESIDE)])
    ground = Ground(lowest.normal, float(middle @ lowest.normal) + lowest.height)
    told = lowest.shown >= _SHOWN and beside <= _LEFT * lowest.alike and all(
        ground.height(view.camera.position) > 0 for view in views)
    return ground if told else None


def _peaks(compared: Callable[[NDArray[np.float64], float], _Plane], up: NDArray[np.float64],
           step: float) -> list[_Plane]:
    """Return the planes across about `up` that look most alike, of all heights in steps."""
    heights = (np.arange(_HEIGHTS) - _HEIGHTS // 2) * step
    if max(compared(up, height).shown for height in heights[::_APART]) < _SHOWN:
        return []  # before a plain background, in a fifth of the time
    alike, found = np.array([compared(up, height).alike for height in heights]), []
    for _ in range(_PEAKS):
        peak = int(alike.argmax())
        if alike[peak] > 0:
            found.append(_refined(compared, up, heights[peak], step))
            alike[max(0, peak - _APART):peak + _APART + 1] = 0
    return found


def _reduced(view: PhotoView, middle: NDArray[np.float64], width: float
             ) -> tuple[Camera, NDArray[np.float32]]:
    """Return a camera and its grey image, as fine as the points of the plane."""
    lens = view.camera.intrinsics
    away = float(np.linalg.norm(view.camera.position - middle))
    shrink = min(1.0, _PIXELS * away / (_WIDTH * width / _POINTS * lens.fx))
    size = max(8, round(lens.width * shrink)), max(8, round(lens.height * shrink))
    small = cv2.resize(cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY), size,
                       interpolation=cv2.INTER_AREA)
    return Camera(view.camera.pose, lens.resized(*size)), small.astype(np.float32)


def _refined(compared: Callable[[NDArray[np.float64], float], _Plane], up: NDArray[np.float64],
             height: float, step: float) -> _Plane:
    """Return the plane near a height that looks most alike, with its normal (Nelder, Mead)."""
    along, across, _ = upright(up)

    def plane(place: NDArray[np.float64]) -> _Plane:
        normal = up + place[1] * across + place[2] * along
        return compared(normal / np.linalg.norm(normal), place[0])

    first = np.array([height, 0.0, 0.0])
    simplex = first + np.vstack([np.zeros(3), np.diag([step, _TILT, -_TILT])])
    found = minimize(lambda place: -plane(place).correlation, first, method='Nelder-Mead',
                     options={'initial_simplex': simplex, 'maxfev': _TRIES})
    return plane(found.x)


def _compared(photos: Sequence[tuple[Camera, NDArray[np.float32]]], middle: NDArray[np.float64],
              width: float, normal: NDArray[np.float64], height: float) -> _Plane:
    """Return a plane with the share of its windows that look alike, and that are shown."""
    ticks = ((np.arange(_POINTS) + 0.5) / _POINTS - 0.5) * _WIDTH * width
    along, across, _ = upright(normal)
    points = (middle + height * normal + ticks[:, None, None] * across
              + ticks[None, :, None] * along).reshape(-1, 3)
    windows = [_even(*_seen(camera, grey, points)) for camera, grey in photos]
    telling = np.stack([telling for _, telling in windows])
    texture = np.stack([texture for texture, _ in windows])
    kept = telling * _like(texture, texture.sum(axis=0))
    texture *= kept
    total, squares, count = texture.sum(axis=0), (texture ** 2).sum(axis=0), kept.sum(axis=0)
    # (sum of r_i r_j over pairs) / (the same if all r were equal), window by window
    alike = _window(total ** 2 - squares) / np.maximum(
        _window(np.maximum(count - 1, 0) * squares), 1e-3)
    alike = np.where(count >= np.maximum(_FEWEST, telling.sum(axis=0) / 2), alike, 0)
    return _Plane(normal, height, float((alike > _ALIKE).mean()), float(alike.mean()),
                  float((telling.sum(axis=0) >= _FEWEST).mean()))


def _even(seen: NDArray[np.float32], shown: NDArray[np.float32]
          ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the texture of windows without their light, (P, P), and 1 where there is any."""
    weight = np.maximum(_window(shown), 1e-6)
    apart = (seen - _window(seen * shown) / weight) * shown
    spread = np.sqrt(np.maximum(_window(apart * apart) / weight, 0))
    telling = shown * (spread > _TEXTURE)
    return np.asarray(apart / np.maximum(spread, _TEXTURE) * telling, np.float32), telling


def _like(texture: NDArray[np.float32], total: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return where windows of each photo, (V, P, P), are like the sum of the others, (P, P)."""
    alike = []
    for each in texture:
        others = total - each
        product = np.maximum(_window(each ** 2) * _window(others ** 2), 0)
        alike.append(_window(each * others) > _LIKE * np.sqrt(product))
    return np.stack(alike)


def _seen(camera: Camera, grey: NDArray[np.float32], points: NDArray[np.float64]
          ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return what a photo shows at points, (P, P), and 1 where it shows them, else 0."""
    pixels, depth = camera.project(points)
    across, down = np.minimum(np.fmax(pixels, -1e4), 1e4).T.reshape(  # nan is far away, too
        2, _POINTS, _POINTS).astype(np.float32)
    rows, columns = grey.shape
    shown = ((depth > 0).reshape(across.shape) & (across >= 0) & (across < columns)
             & (down >= 0) & (down < rows))
    seen = cv2.remap(grey, across - 0.5, down - 0.5, cv2.INTER_LINEAR,
                     borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, np.float32), shown.astype(np.float32)


def _window(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the mean of the window around each point, nothing beyond the plane's edge."""
    return np.asarray(cv2.boxFilter(values, -1, (_WINDOW, _WINDOW),
                                    borderType=cv2.BORDER_CONSTANT), np.float32)
