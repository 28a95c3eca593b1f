"""A photo at the size at which silhouettes are searched."""

from dataclasses import dataclass

from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class SeenPhoto:
    """
    A photo, reduced to the size at which it is searched.

    - camera: of this size
    - image: (H, W, 3) float32 in [0, 255]; even: the same in the light of the other photos
    - known: (H, W) bool, where it is known what is seen without the object, or how likely the
      object is; expected: (H, W, 3), what is seen there without the object, in this light
    """

    camera: Camera
    image: NDArray[np.float32]
    even: NDArray[np.float32]
    known: NDArray[np.bool_]
    expected: NDArray[np.float32]
