"""The object frame on the plate: its origin is half the object's cube above it."""

from dataclasses import dataclass
import math

from active_recon.calibration.board import Board
from active_recon.calibration.turntable import TurntableFit
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Placement:
    """
    The position of the object's cube relative to the board.

    - object_size: side of the cube, metres
    - board_thickness: height of the board's face above the plate on which the object will stand,
      metres
    - azimuth_at_zero: azimuth of the camera at table angle 0, radians; it fixes the x axis of the
      object frame, the object's front

    Raises ConfigError unless all are finite and `object_size` is above 0.
    """

    object_size: float
    board_thickness: float = 0.0
    azimuth_at_zero: float = 0.0

    def __post_init__(self) -> None:
        """Reject invalid sizes."""
        if not 0 < self.object_size < np.inf:
            raise ConfigError('object_size: out of range: expected metres above 0, got '
                              f'{self.object_size}')
        for name in ('board_thickness', 'azimuth_at_zero'):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f'{name}: not finite: expected a number, got '
                                  f'{getattr(self, name)}')

    @property
    def above_board(self) -> float:
        """Height of the cube's centre above the board's face, metres."""
        return self.object_size / 2 - self.board_thickness

    def on_table(self, found: TurntableFit) -> NDArray[np.float64]:
        """
        Return the camera's pose in the object frame at table angle 0, (4, 4).

        Raises DataError where the camera is below the plate or in the object's cube.
        """
        height = found.board_height + self.above_board
        camera = Camera(_moved(0, 0, -height) @ np.linalg.inv(found.camera_from_table))
        if camera.position[2] < -self.object_size / 2:
            raise DataError('camera below the plate: expected it above, got one '
                            f'{-camera.position[2] - self.object_size / 2:.3f} m below it',
                            'below')
        if np.abs(camera.position).max() < self.object_size / 2:
            raise DataError("camera in the object's cube: expected it outside, got one "
                            f'{camera.distance:.3f} m from the centre of a cube of '
                            f'{self.object_size:g} m; is the size of the object in metres?',
                            'inside')
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler(
            'z', self.azimuth_at_zero - camera.azimuth).as_matrix()
        pose: NDArray[np.float64] = turn @ camera.pose
        return pose

    def on_board(self, board: Board) -> NDArray[np.float64]:
        """
        Return board from object, (4, 4), for a fixed board.

        The cube is on the board's centre, with its front along the board's rows.
        """
        face_up = np.diag([1.0, -1.0, -1.0, 1.0])
        middle = _moved(board.columns * board.square / 2, board.rows * board.square / 2, 0)
        pose: NDArray[np.float64] = middle @ face_up @ _moved(0, 0, self.above_board)
        return pose


def cube_corners(object_size: float) -> NDArray[np.float64]:
    """Return the corners of the object's cube in its frame, metres, (8, 3)."""
    return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
                    ) * object_size / 2


def _moved(x: float, y: float, z: float) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose
