"""Where a fixed camera stands in the frame of an object that a turntable turns before it."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

DIRECTIONS = (-1, 1)
"""Seen from above, where the joint's angle grows: clockwise, counter-clockwise."""


@dataclass(frozen=True, eq=False)
class FixedCamera:
    """
    A camera that stands still while the object turns about the z axis of its frame.

    `pose_at_zero` is the camera's pose in the object frame while the turntable's joint stands at
    0, (4, 4) object from optical frame, metres; `direction` is 1 where the joint's angle grows as
    the object turns counter-clockwise, seen from above, -1 where it grows clockwise.
    """

    pose_at_zero: NDArray[np.float64]
    direction: int = 1

    def __post_init__(self) -> None:
        """Reject what is no pose, and no direction."""
        Camera(self.pose_at_zero)
        if self.direction not in DIRECTIONS:
            raise ConfigError('turntable_direction: invalid direction: expected 1 or -1, got '
                              f'{self.direction}')

    @classmethod
    def from_parameters(cls, position: Sequence[float], orientation: Sequence[float],
                        direction: int = 1) -> 'FixedCamera':
        """
        Return the camera at x, y, z in metres, turned by the unit quaternion x, y, z, w.

        Raises ConfigError that names `camera_position` or `camera_orientation`.
        """
        if len(position) != 3 or not np.isfinite(position).all() or not np.any(position):
            raise ConfigError('camera_position: invalid position: expected x, y, z of the camera '
                              'in the object frame, metres, away from its origin, got '
                              f'{list(position)}; active-recon calibrate finds them')
        if len(orientation) != 4 or not abs(np.linalg.norm(orientation) - 1) < 0.01:
            raise ConfigError('camera_orientation: invalid orientation: expected x, y, z, w of '
                              f"the optical frame's unit quaternion, got {list(orientation)}; "
                              'active-recon calibrate finds them')
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(orientation).as_matrix()
        pose[:3, 3] = position
        return cls(pose, direction)

    def pose_at(self, angle: float) -> NDArray[np.float64]:
        """
        Return the camera's pose in the object frame, (4, 4), at an angle of the joint in radians.

        Its azimuth is that at 0 minus what the object has turned counter-clockwise. Raises
        ViewError where the angle is not finite.
        """
        if not math.isfinite(angle):
            raise ViewError("invalid joint position: expected a finite angle of the turntable's "
                            f'joint, got {angle}', 'joint')
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler('z', -self.direction * angle).as_matrix()
        pose: NDArray[np.float64] = turn @ self.pose_at_zero
        return pose
