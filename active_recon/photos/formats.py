"""Formats of photos: which files are photos, and what is done about those that need more."""

from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from active_recon.calibration.files import SUFFIXES
from active_recon.errors import DataError
from PIL import Image

HEIC_ENDINGS = ('.heic', '.heif', '.hif')
ENDINGS = (*SUFFIXES, '.webp', '.avif', *HEIC_ENDINGS)
RAW_ENDINGS = ('.3fr', '.arw', '.cr2', '.cr3', '.crw', '.dng', '.nef', '.nrw', '.orf', '.pef',
               '.raf', '.rw2', '.srw', '.x3f')
JPEG_ADVICE = ('let the camera take JPEG (on an iPhone: Settings, Camera, Formats, Most '
               'Compatible)')
"""What to do about the format that phones may use."""
_HEIC_ADVICE = ('HEIC, which needs the package pillow-heif: install it by: pip install '
                f"'active_recon[heic]', or {JPEG_ADVICE}")
_RAW_ADVICE = 'a raw photo: convert it to JPEG or TIFF, for example with darktable'
_HEIC_BRANDS = {b'heic', b'heix', b'heim', b'heis', b'hevc', b'hevx', b'hevm', b'hevs', b'mif1',
                b'msf1'}
_AVIF_BRANDS = {b'avif', b'avis'}  # of the same container, but read by Pillow itself


def is_heic(start: bytes) -> bool:
    """Return whether a file that starts so, with 64 bytes or more, is HEIC, whatever its name."""
    box = start[:min(int.from_bytes(start[:4], 'big'), 64)]
    brands = {box[8:12], *(box[at:at + 4] for at in range(16, len(box), 4))}
    return (box[4:8] == b'ftyp' and bool(brands & _HEIC_BRANDS)
            and not brands & _AVIF_BRANDS)


def require_reader(source: Path | BinaryIO) -> None:
    """Let Pillow read a file; raises DataError that tells what to do where it cannot."""
    if isinstance(source, Path):
        if source.suffix.lower() in RAW_ENDINGS:
            raise DataError(_RAW_ADVICE)
        with source.open('rb') as file:
            start = file.read(64)
    else:
        start = source.read(64)
        source.seek(0)
    if is_heic(start):
        try:
            heif = import_module('pillow_heif')
        except ImportError as error:
            raise DataError(_HEIC_ADVICE) from error
        heif.register_heif_opener(thumbnails=False, depth_images=False, aux_images=False)


def turned_already(image: Image.Image) -> int:
    """Return the EXIF orientation by which an opened image is turned: HEIC's, else 1."""
    turned = int(image.info.get('original_orientation') or 1) if image.format == 'HEIF' else 1
    return turned if 2 <= turned <= 8 else 1
