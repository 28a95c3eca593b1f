"""Photos of an object on a board, as files that may arrive one after the other."""

from active_recon.geometry.cameras import orbit_camera
import numpy as np
from photo_board import around, photographed, standing
from photo_scene import thing
from PIL import ExifTags, Image
from rendered_boards import LENS

SIZE = 0.12
FILM = LENS.fx * np.hypot(36, 24) / np.hypot(LENS.width, LENS.height)
"""Focal length of the lens as EXIF has it, for a film of 36 x 24 mm."""


def written(folder, count=4):
    """Write so many photos into a folder, without EXIF; return their paths in order."""
    images, _ = photographed(standing(thing(), SIZE), around(count, 0.3 * SIZE))
    paths = [folder / f'{number}.png' for number in range(count)]
    for path, image in zip(paths, images, strict=True):
        Image.fromarray(image).save(path)
    return paths


def with_focal(path, out):
    """Write a photo with its focal length in EXIF."""
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = FILM
    with Image.open(path) as image:
        image.save(out, exif=exif, quality=95)
    return out


def orbit(azimuth_deg, elevation_deg=30, distance=0.5):
    return orbit_camera(np.radians(azimuth_deg), np.radians(elevation_deg), distance)
