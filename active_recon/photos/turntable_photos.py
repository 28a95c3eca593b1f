"""Photos of a turntable that turns by the same angle between them, before a fixed camera."""

from collections.abc import Sequence
import math

from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.photos.camera_file import CameraFile, PosedPhoto
from active_recon.photos.files import PhotoFile
import numpy as np


def turntable_photos(photos: Sequence[PhotoFile], step: float, elevation: float, distance: float,
                     field_of_view: float | None = None) -> tuple[CameraFile, list[PosedPhoto]]:
    """
    Return the cameras of photos in the order of the table's turn, radians and metres.

    `step` is the table's turn between photos, counter-clockwise seen from above, and to those that
    are `lost` between them. The camera looks at the origin, which is on the axis, from `distance`
    at `elevation`. Its horizontal `field_of_view` is that of the photos as stored; None: by EXIF's
    focal length. Raises DataError where a photo has none, ConfigError on an angle that cannot be.
    """
    if field_of_view is not None and not 0 < field_of_view < math.pi:
        raise ConfigError('field of view: out of range: expected more than 0 and less than 180 '
                          f'degrees, got {math.degrees(field_of_view):g}')
    if not math.isfinite(step) or step == 0:
        raise ConfigError(f'step of the turntable: expected an angle other than 0, got {step}')
    posed = []
    turned = 0.0
    for photo in photos:
        focal = (photo.focal if field_of_view is None
                 else photo.size[0] / 2 / math.tan(field_of_view / 2))
        if focal is None:
            raise DataError(f'{photo.name}: no focal length: expected it in EXIF; give the '
                            'horizontal field of view by --fov-deg', 'no_focal_length')
        width, height = photo.upright_size
        lens = Intrinsics(focal, focal, width / 2, height / 2, width, height)
        posed.append(PosedPhoto(photo, orbit_camera(-turned, elevation, distance).pose, lens))
        turned += step * (1 + photo.lost)
    return CameraFile('turntable', (), np.array([0.0, 0.0, 1.0]), metric=True), posed
