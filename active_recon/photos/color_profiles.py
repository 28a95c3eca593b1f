"""Colours of photos as sRGB, whatever their cameras took them for."""

from functools import lru_cache
from io import BytesIO
from typing import Any

from PIL import Image, ImageCms

_KEPT = 8
"""Profiles, of which the photos of a camera have one."""


def in_srgb(image: Image.Image, profile: bytes | None) -> Image.Image:
    """
    Return an image of 8 bits a channel in sRGB, by the ICC profile that its file has.

    Phones take photos in Display P3, cameras in Adobe RGB if they are set so: read as sRGB, they
    look pale. The image is RGB or RGBA; without a profile, or with a damaged one, it stays as it
    is.
    """
    transform = _to_srgb(profile, image.mode) if profile else None
    return image if transform is None else ImageCms.applyTransform(image, transform) or image


@lru_cache(maxsize=_KEPT)
def _to_srgb(profile: bytes, mode: str) -> Any:
    """Return what converts to sRGB; None where nothing is to be done, or nothing can be."""
    try:
        own = ImageCms.ImageCmsProfile(BytesIO(profile))
        if 'srgb' in ImageCms.getProfileDescription(own).lower():
            return None
        return ImageCms.buildTransform(own, ImageCms.createProfile('sRGB'), mode, mode)
    except (ImageCms.PyCMSError, OSError):
        return None
