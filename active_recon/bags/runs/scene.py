"""What a bag may lack: the object's size and front, the camera's pose, the background."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
import math
from pathlib import Path

from active_recon.acquisition.background import Background
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_ELEVATION,
    orbit_camera,
)
from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.segmentation import shipped_segmentation
import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Scene:
    """
    The options that complete a bag; None: as recorded, else as in the canonical scene.

    - object_size: side of the voxel grid, m; object_yaw: azimuth of the object's front, rad
    - elevation: of the camera, rad, if the bag has its azimuth only
    - camera_position: (3,), m, in the object's frame at the recorded angle 0;
      camera_orientation: its optical frame's unit quaternion x, y, z, w, None: it looks at the
      object's centre, upright
    - object_position: centre of the object's cube in the frame of the camera's poses, (3,), m
    - background: how the background is removed; empty_scene: (H, W, 3) uint8 RGB
    """

    object_size: float | None = None
    object_yaw: float | None = None
    elevation: float | None = None
    camera_position: Sequence[float] | None = None
    camera_orientation: Sequence[float] | None = None
    object_position: Sequence[float] | None = None
    background: Background = Background()
    empty_scene: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        """Raise ConfigError on an incomplete or contradictory camera pose."""
        if self.camera_position is None and self.camera_orientation is not None:
            raise ConfigError('--camera-orientation needs --camera-position: give both')
        if self.camera_position is not None and self.elevation is not None:
            raise ConfigError('--elevation-deg and --camera-position both set the elevation: '
                              'give one of them')
        if self.camera_position is not None:
            self._fixed_camera(turned_object=True)

    @property
    def size(self) -> float:
        """Side of the grid in metres, 1 by default."""
        return 1.0 if self.object_size is None else self.object_size

    @property
    def canonical_distances(self) -> float:
        """The camera's distance in those of the canonical one, whose image the object fills."""
        if self.camera_position is None:
            return 1.0
        return float(np.linalg.norm(self.camera_position)) / (CANONICAL_DISTANCE * self.size)

    @property
    def parameters(self) -> Mapping[str, float | None]:
        """The parameters of reconstructor and planner among the options."""
        return {'object_size': self.object_size, 'object_yaw': self.object_yaw}

    def pose_at(self, angle: float, turned_object: bool) -> NDArray[np.float64]:
        """
        Return the camera's pose (4, 4), object from optical frame, at a recorded angle in radians.

        It is the camera's own azimuth or, with `turned_object`, that of the turntable.
        """
        if self.camera_position is None:
            return self.orbit_pose(-angle if turned_object else angle)
        return self._fixed_camera(turned_object).pose_at(angle)

    def about_object(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a recorded pose of the camera (4, 4) with the object's centre as the origin."""
        if self.object_position is None:
            return pose
        moved = pose.copy()
        moved[:3, 3] -= self.object_position
        return moved

    def orbit_pose(self, azimuth: float) -> NDArray[np.float64]:
        """Return the pose of a camera at that azimuth, which looks at the object's centre."""
        elevation = CANONICAL_ELEVATION if self.elevation is None else self.elevation
        return orbit_camera(azimuth, elevation, CANONICAL_DISTANCE * self.size).pose

    def reject_redundant(self, topic: str, has_poses: bool, has_camera: bool) -> None:
        """Raise ConfigError on options for what the bag has: poses, or poses and lens."""
        if has_poses and self.camera_position is not None:
            raise ConfigError('--camera-position: not needed: the bag has camera poses on '
                              f'{topic}')
        if not has_poses and self.object_position is not None:
            raise ConfigError('--object-position: not for azimuths, which the bag has on '
                              f'{topic}: they are those around the object')
        if has_camera and self.elevation is not None:
            raise ConfigError(f'--elevation-deg: not needed: the bag has camera poses on {topic}, '
                              'and camera info')

    def assumed(self, image: str, has_poses: bool, has_lens: bool) -> list[str]:
        """Return in words what neither bag nor options state, each with its option."""
        placed = has_poses or self.camera_position is not None
        missing = [option for option, known in (
            ('--camera-info', has_lens), ('--camera-position', placed)) if not known]
        assumptions = []
        if missing:
            assumptions.append(f'the lens on {image}: the object fills the shorter side '
                               f'({" and ".join(missing)})')
        if missing and self.elevation is None and self.camera_position is None:
            assumptions.append(f'elevation {math.degrees(CANONICAL_ELEVATION):.0f} degrees '
                               f'(--elevation-deg{"" if has_poses else " or --camera-position"})')
        return assumptions

    def cleared(self, image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
        """Return a camera's image with its background removed as set up; raises ViewError."""
        segmented = None if self.background.how != 'segment' else partial(
            shipped_segmentation().on_white, camera=camera, object_size=self.size)
        return self.background.cleared(image, None, self.empty_scene, segmented)

    def _fixed_camera(self, turned_object: bool) -> FixedCamera:
        position = np.asarray(self.camera_position, np.float64)
        direction = 1 if turned_object else -1
        if self.camera_orientation is not None or position.shape != (3,) or not position.any():
            return FixedCamera.from_parameters(
                position.tolist(), self.camera_orientation or (0, 0, 0, 1), direction)
        distance = float(np.linalg.norm(position))
        return FixedCamera(orbit_camera(
            math.atan2(position[1], position[0]), math.asin(position[2] / distance),
            distance).pose, direction)


def parse_background(option: str) -> tuple[Background, NDArray[np.uint8] | None]:
    """
    Return how the background is removed, and the image of the empty scene if there is one.

    `option` is `segment`, a colour, red,green,blue, or the path of such an image; '' keeps the
    background. Raises ConfigError if it is neither.
    """
    if option in ('', 'segment'):
        return Background(option or 'as_is'), None
    channels = option.split(',')
    if all(channel.strip().isdecimal() for channel in channels):
        return Background('color', tuple(map(int, channels))), None
    if not Path(option).is_file():
        raise ConfigError(f'--background: {option} is neither segment, nor a colour, such as '
                          '0,177,64, nor a file with an image of the empty scene')
    image = cv2.imread(option, cv2.IMREAD_COLOR)
    if image is None:
        raise ConfigError(f'--background: {option} is no readable image')
    return Background('reference'), np.ascontiguousarray(image[..., ::-1], np.uint8)
