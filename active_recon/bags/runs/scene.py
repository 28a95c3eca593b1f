"""What a bag of others does not tell of the scene: sizes, the camera's place, the background."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.acquisition.background import Background
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import CANONICAL_DISTANCE, CANONICAL_ELEVATION, orbit_camera
from active_recon.geometry.turntable_pose import FixedCamera
import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Scene:
    """
    What is told beside a bag; None: as recorded, else as the canonical scene has it.

    - object_size: side of the voxel grid, m; object_yaw: azimuth of the object's front, rad
    - elevation: of the camera, rad, where the bag tells its azimuth alone
    - camera_position: (3,), m, in the object's frame while the recorded angle is 0;
      camera_orientation: its optical frame's unit quaternion x, y, z, w, None: it looks at the
      object's centre, upright
    - background: how the object is told from what is behind it; empty_scene: (H, W, 3) uint8 RGB
    """

    object_size: float | None = None
    object_yaw: float | None = None
    elevation: float | None = None
    camera_position: Sequence[float] | None = None
    camera_orientation: Sequence[float] | None = None
    background: Background = Background()
    empty_scene: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        """Refuse a camera that stands nowhere, or at two places."""
        if self.camera_position is None and self.camera_orientation is not None:
            raise ConfigError('--camera-orientation without --camera-position: give both')
        if self.camera_position is not None and self.elevation is not None:
            raise ConfigError('--elevation-deg and --camera-position both tell the elevation: '
                              'give one of them')
        if self.camera_position is not None:
            self._fixed_camera(turned_object=True)

    @property
    def size(self) -> float:
        """Side of the grid in metres: 1 where nobody tells."""
        return 1.0 if self.object_size is None else self.object_size

    @property
    def given(self) -> Mapping[str, float | None]:
        """What of it a reconstructor and a planner are told."""
        return {'object_size': self.object_size, 'object_yaw': self.object_yaw}

    def pose_at(self, angle: float, turned_object: bool) -> NDArray[np.float64]:
        """
        Return the camera's pose (4, 4), object from optical frame, at a recorded angle in radians.

        It is the camera's own azimuth or, with `turned_object`, that of the turntable.
        """
        if self.camera_position is None:
            return self.orbit_pose(-angle if turned_object else angle)
        return self._fixed_camera(turned_object).pose_at(angle)

    def orbit_pose(self, azimuth: float) -> NDArray[np.float64]:
        """Return the pose of a camera at that azimuth, which looks at the object's centre."""
        elevation = CANONICAL_ELEVATION if self.elevation is None else self.elevation
        return orbit_camera(azimuth, elevation, CANONICAL_DISTANCE * self.size).pose

    def require_needed(self, topic: str, has_poses: bool, whole: bool) -> None:
        """Raise ConfigError where the bag tells what was given: poses, or the `whole` camera."""
        if has_poses and self.camera_position is not None:
            raise ConfigError(f'--camera-position: the bag has the poses of the camera on {topic}')
        if whole and self.elevation is not None:
            raise ConfigError(f'--elevation-deg: the bag has the poses of the camera on {topic}, '
                              'and its camera info')

    def assumed(self, image: str, has_poses: bool, has_lens: bool) -> list[str]:
        """Return in words what neither a bag nor this tells, each with the option that would."""
        placed = has_poses or self.camera_position is not None
        missing = [option for option, known in (
            ('--camera-info', has_lens), ('--camera-position', placed)) if not known]
        told = []
        if missing:
            told.append(f'the lens on {image}: the object fills the shorter side '
                        f'({" and ".join(missing)})')
        if missing and self.elevation is None and self.camera_position is None:
            told.append(f'elevation {math.degrees(CANONICAL_ELEVATION):.0f} degrees '
                        f'(--elevation-deg{"" if has_poses else " or --camera-position"})')
        return told

    def cleared(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an image with its background white, if so told; raises ViewError."""
        return self.background.cleared(image, reference=self.empty_scene)

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


def told_background(told: str) -> tuple[Background, NDArray[np.uint8] | None]:
    """
    Return how the object is told from its background, and the image of the empty scene if any.

    `told` is a colour, red,green,blue, or the path of such an image; '' leaves images as they are.
    """
    if not told:
        return Background(), None
    shares = told.split(',')
    if all(share.strip().isdecimal() for share in shares):
        return Background('color', tuple(map(int, shares))), None
    if not Path(told).is_file():
        raise ConfigError(f'--background: {told} is neither a colour, such as 0,177,64, nor a '
                          'file with an image of the empty scene')
    image = cv2.imread(told, cv2.IMREAD_COLOR)
    if image is None:
        raise ConfigError(f'--background: {told} is no image that can be read')
    return Background('reference'), np.ascontiguousarray(image[..., ::-1], np.uint8)
