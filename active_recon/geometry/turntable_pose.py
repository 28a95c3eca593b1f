"""The pose of a fixed camera in the frame of an object on a turntable."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.rotations import pose_from_quaternion
import numpy as np
from numpy.typing import NDArray

DIRECTIONS = (-1, 1)
"""The rotation, seen from above, in which the joint's angle increases: clockwise or not."""


@dataclass(frozen=True, eq=False)
class FixedCamera:
    """
    A fixed camera in front of an object that rotates about the z axis of the object frame.

    `pose_at_zero` is the camera's pose in the object frame at joint angle 0, (4, 4) object from
    optical frame, metres. `direction` is 1 where the joint's angle increases as the object turns
    counter-clockwise, seen from above, and -1 where it increases clockwise. Raises ViewError on
    an invalid pose, ConfigError on any other direction.
    """

    pose_at_zero: NDArray[np.float64]
    direction: int = 1

    def __post_init__(self) -> None:
        """Reject an invalid pose or direction."""
        Camera(self.pose_at_zero)
        if self.direction not in DIRECTIONS:
            raise ConfigError('turntable_direction: invalid direction: expected 1 or -1, got '
                              f'{self.direction}')

    @classmethod
    def from_parameters(cls, position: Sequence[float], orientation: Sequence[float],
                        direction: int = 1) -> 'FixedCamera':
        """
        Return the camera at `position` x, y, z (metres) with the unit quaternion x, y, z, w.

        Both are in the object frame at joint angle 0. Raises ConfigError that names the parameter
        `camera_position` or `camera_orientation`.
        """
        if len(position) != 3 or not np.isfinite(position).all() or not np.any(position):
            raise ConfigError('camera_position: invalid position: expected x, y, z of the camera '
                              'in the object frame, metres, other than 0, 0, 0, got '
                              f'{list(position)}; active-recon calibrate measures it')
        if len(orientation) != 4 or not abs(np.linalg.norm(orientation) - 1) < 0.01:
            raise ConfigError('camera_orientation: invalid orientation: expected x, y, z, w of '
                              f"the optical frame's unit quaternion, got {list(orientation)}; "
                              'active-recon calibrate measures it')
        return cls(pose_from_quaternion(position, orientation), direction)

    def pose_at(self, angle: float) -> NDArray[np.float64]:
        """
        Return the camera's pose in the object frame, (4, 4), at a joint angle in radians.

        Its azimuth is that at angle 0 minus the object's counter-clockwise rotation. Raises
        ViewError where the angle is not finite.
        """
        if not math.isfinite(angle):
            raise ViewError("invalid joint position: expected a finite angle of the turntable's "
                            f'joint, got {angle}', 'joint')
        cosine, sine = math.cos(angle), -self.direction * math.sin(angle)
        turn = np.eye(4)
        turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
        pose: NDArray[np.float64] = turn @ self.pose_at_zero
        return pose
