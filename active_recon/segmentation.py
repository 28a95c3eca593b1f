"""The object on white before any background: a segmenter beside the camera's image."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framed_image
from active_recon.geometry.resampling import carried_back
from active_recon.runtimes import AUTO, load_segmenter_runtime, SegmenterRuntime
import cv2
import numpy as np
from numpy.typing import NDArray

_UNSURE = 0.02  # shares up to this are 0, and from 1 less this on 1
_LEAST = 0.002  # of the pixels around the cube that are rather the object than not


@dataclass(frozen=True, eq=False)
class FramedShares:
    """
    What was found in the image around an object's cube.

    - image: (S, S, 3 or 4) uint8, the fourth channel 255 where the camera saw the pixel
    - shares: (S, S) in [0, 1], how much of each pixel is the object; camera: of this image
    """

    image: NDArray[np.uint8]
    shares: NDArray[np.float32]
    camera: Camera


class Segmentation:
    """
    Puts the object on white, where a segmenter finds it in the image around its cube.

    It looks at one image alone, of any camera, and knows nothing of the views before.
    """

    def __init__(self, runtime: SegmenterRuntime) -> None:
        self._runtime = runtime

    @classmethod
    def load(cls, weights: Path | None = None, device: str = 'cpu', threads: int | None = None,
             runtime: str = AUTO, precision: str = 'auto') -> 'Segmentation':
        """
        Load a segmenter; None: the one that ships. For the rest see `load_runtime`.

        Raises WeightsError and ConfigError.
        """
        return cls(load_segmenter_runtime(weights, runtime, device, threads, precision))

    @property
    def provenance(self) -> Mapping[str, str]:
        """What diagnostics tell of the segmenter's runtime."""
        return self._runtime.provenance

    def warm_up(self) -> None:
        """Run once, so that the first view is as fast as the others."""
        self._runtime.segment(np.zeros((self._runtime.image_size,) * 2 + (3,), np.uint8))

    def shares(self, image: NDArray[np.uint8], camera: Camera,
               object_size: float = 1.0) -> NDArray[np.float32]:
        """
        Return how much of each pixel of an image, (H, W, 3) uint8 RGB, is the object, (H, W).

        `object_size` is the side of the object's cube, metres: what is outside of it in the image
        is background. Raises ViewError as `framed_image` does, and where no object is found.
        """
        found = self.framed(image, camera, object_size)
        return carried_back(found.shares, found.camera, camera)

    def framed(self, image: NDArray[np.uint8], camera: Camera,
               object_size: float = 1.0) -> FramedShares:
        """Return what is found in the image around the object's cube; see `shares`."""
        framed, target = framed_image(image, camera, object_size, self._runtime.image_size)
        found = self._runtime.segment(framed)
        if framed.shape[2] == 4:
            found = np.where(framed[..., 3] > 127, found, np.float32(0))
        if (found > 0.5).mean() < _LEAST:
            raise ViewError("no object found: expected one in the image of the object's cube, but "
                            'the segmenter takes all of it for background', 'no_object')
        return FramedShares(framed, found, target)

    def on_white(self, image: NDArray[np.uint8], camera: Camera,
                 object_size: float = 1.0) -> NDArray[np.uint8]:
        """Return an image with a white background, edges in between; see `shares`."""
        return on_white_by(self.shares(image, camera, object_size), image)


def on_white_by(shares: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image, (H, W, 3) uint8 RGB, on white by the object's shares of pixels, (H, W)."""
    certain = (shares - _UNSURE) / (1 - 2 * _UNSURE)
    levels = np.rint(255 * certain.clip(0, 1)).astype(np.uint8)
    planes = cv2.merge([levels] * 3)
    shown = cv2.multiply(image, planes, scale=1 / 255)
    return np.asarray(cv2.add(shown, cv2.bitwise_not(planes)), np.uint8)


@cache
def shipped_segmentation(threads: int | None = None) -> Segmentation:
    """Return the segmenter that ships, loaded when it is first needed; see `Segmentation.load`."""
    return Segmentation.load(threads=threads)
