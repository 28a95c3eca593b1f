"""Images as a phone takes them by hand: blurred, skewed, unevenly exposed, and compressed."""

import cv2
import numpy as np

JPEG_QUALITY = 80
_BLUR = 3.0  # pixels of 640 that the image moves while a row is exposed, at most
_SKEW = 4.0  # pixels of 640 that the last row is read aside of the first, at most
_EXPOSURE = 1.35  # ratio between photos, and between the rows of one, at most
_NOISE = 3.0  # grey levels


def as_of_a_phone(image, rng):
    """
    Return an image, (H, W, 3) uint8 RGB, as a phone in a hand with a rolling shutter takes it.

    The rows are exposed one after the other while the hand moves and the exposure changes. The
    result was compressed as JPEG.
    """
    height, width = image.shape[:2]
    unit = width / 640
    across, down = np.meshgrid(np.arange(width, dtype=np.float32),
                               np.arange(height, dtype=np.float32))
    drift = np.linspace(-0.5, 0.5, height, dtype=np.float32)[:, None]
    aside, along = rng.uniform(-_SKEW, _SKEW, 2).astype(np.float32) * np.float32(unit)
    shown = cv2.remap(image, across + aside * drift, down + along * drift, cv2.INTER_LINEAR,
                      borderMode=cv2.BORDER_REPLICATE)
    shown = cv2.filter2D(shown, -1, _moved(rng.uniform(0.5, _BLUR) * unit, rng.uniform(0, np.pi)))
    whole, first, last = _EXPOSURE ** rng.uniform(-0.5, 0.5, 3)
    exposed = shown * whole * np.linspace(first, last, height)[:, None, None]
    exposed = np.clip(exposed + rng.normal(0, _NOISE, exposed.shape), 0, 255).astype(np.uint8)
    _, packed = cv2.imencode('.jpg', exposed[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return np.ascontiguousarray(cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1])


def _moved(length, angle):
    """Return the kernel of a motion by some pixels in a direction; its sum is 1."""
    side = 2 * int(np.ceil(length)) + 1
    kernel = np.zeros((side, side), np.float32)
    for share in np.linspace(-0.5, 0.5, 32):
        x, y = (side // 2 + share * length * part for part in (np.cos(angle), np.sin(angle)))
        left, top = int(np.floor(x)), int(np.floor(y))
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            weight = (1 - abs(x - left - dx)) * (1 - abs(y - top - dy))
            if left + dx < side and top + dy < side:
                kernel[top + dy, left + dx] += weight
    return kernel / kernel.sum()
