"""Camera poses read in the wrong convention: how they show, and which one would fit."""

from collections.abc import Mapping, Sequence

from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.photos.cube import meeting_point
from active_recon.photos.readers import other_looks
from active_recon.photos.transforms_json import FLIP
import numpy as np
from numpy.typing import NDArray

_FAR = 0.35  # of the distance: optical axes that miss each other by more do not meet
_NAMES = {'opencv': 'OpenCV', 'opengl': 'OpenGL'}
_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])


def conventions(poses: Sequence[NDArray[np.float64]], looks: str
                ) -> Mapping[str, list[NDArray[np.float64]]]:
    """
    Return poses (4, 4) as other conventions would read them, by what to do about it.

    `looks`, one of LOOKS, are the camera axes that they were read with.
    """
    flipped = [pose @ FLIP for pose in poses]
    other = other_looks(looks)
    return {
        f"the other camera axes ({_NAMES[other]}'s instead of {_NAMES[looks]}'s) would fit: give "
        f'--axes {other}': flipped,
        'camera from world instead of world from camera would fit: invert the matrices':
            [_inverse(pose) for pose in poses],
        'camera from world would fit, if the matrices are of OpenGL: invert them':
            [_inverse(pose) @ FLIP for pose in flipped],
        'camera from world with the other camera axes would fit: invert the matrices and give '
        f'--axes {other}': [_inverse(pose) for pose in flipped] if other == 'opencv' else [
            _inverse(pose) @ FLIP for pose in poses],
        'photos turned by 180 degrees would fit: turn them':
            [pose @ _HALF_TURN for pose in poses]}


def misreading(cameras: Sequence[Camera], centre: NDArray[np.float64] | None,
               looks: str) -> str:
    """
    Return what is wrong with the poses of cameras, and what would fit; '' where nothing is.

    Optical axes have to pass by the object, in front of the cameras. `centre` (3,) is the
    object's; None: where the axes meet. `looks` is as in `conventions`.
    """
    if len(cameras) < 2 or looks_right(cameras, centre):
        return ''
    lenses = [camera.intrinsics for camera in cameras]
    poses = [camera.pose for camera in cameras]
    for advice, others in conventions(poses, looks).items():
        if looks_right([Camera(pose, lens) for pose, lens in zip(others, lenses, strict=True)],
                       centre):
            return f'the cameras do not look at one object: {advice}'
    return ''


def looks_right(cameras: Sequence[Camera], centre: NDArray[np.float64] | None = None) -> bool:
    """Return whether most optical axes pass in front of the cameras by one point, or `centre`."""
    try:
        point = meeting_point(cameras) if centre is None else centre
    except DataError:  # parallel axes meet nowhere
        return False
    towards = np.array([point - camera.position for camera in cameras])
    forward = np.array([camera.pose[:3, 2] for camera in cameras])
    depths = (towards * forward).sum(axis=1)
    aside = np.linalg.norm(towards - depths[:, None] * forward, axis=1)
    away = np.linalg.norm(towards, axis=1)
    return bool(np.median(depths) > 0 and np.mean(depths > 0) > 0.8
                and np.median(aside / np.where(away > 0, away, 1)) < _FAR)


def _inverse(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(pose), np.float64)
