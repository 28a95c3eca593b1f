"""Images embedded in the page."""

from base64 import b64encode

import cv2
import numpy as np
from numpy.typing import NDArray

_QUALITY = 85


def data_uri(image: NDArray[np.uint8], longest: int) -> str:
    """Return an image (H, W, 3) uint8 RGB as a WebP URI, its longer side at most `longest`."""
    scale = longest / max(image.shape[:2])
    if scale < 1:
        height, width = (max(1, round(side * scale)) for side in image.shape[:2])
        image = np.asarray(
            cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
    _, encoded = cv2.imencode('.webp', image[..., ::-1], [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    return 'data:image/webp;base64,' + b64encode(encoded.tobytes()).decode()
