"""Calibration of a turntable: its axis in the frame of a fixed camera, from a rotating board."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.calibration.axis import compare_angles, find_axis
from active_recon.calibration.board import Detection
from active_recon.calibration.fit import fit, fitted_images, ImageFit, parameters_of, rigid
from active_recon.calibration.lens import board_pose
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
import numpy as np
from numpy.typing import NDArray

FEWEST_IMAGES = 3
_FACE_UP = np.diag([1.0, -1.0, -1.0, 1.0])  # rotation of a board on the plate: its z points down


@dataclass(frozen=True, eq=False)
class TurntableFit:
    """
    A turntable in the frame of a fixed camera.

    - camera_from_table: at table angle 0, (4, 4), metres; the table's frame has z up along the
      axis
    - table_from_board: (4, 4), metres
    - turned: the table's angle in each image, counter-clockwise seen from above, radians, (N,)
    - direction: +1 where the table's own angle increases counter-clockwise, -1 where clockwise,
      None where no angles were given; angle 0 then is that of the first image
    - off: residuals of the given angles, radians, (N,), None where none were given
    """

    camera_from_table: NDArray[np.float64]
    table_from_board: NDArray[np.float64]
    turned: NDArray[np.float64]
    direction: int | None
    off: NDArray[np.float64] | None
    images: list[ImageFit]

    @property
    def board_height(self) -> float:
        """Height (z) in the table's frame at which the axis meets the board, metres."""
        corner, normal = self.table_from_board[:3, 3], self.table_from_board[:3, 2]
        return float(corner @ normal / normal[2])


def fit_turntable(seen: Sequence[Detection], lens: Intrinsics,
                  angles: NDArray[np.float64] | None = None) -> TurntableFit:
    """
    Estimate a turntable's axis in the camera's frame, and the table's angle in each image.

    `angles`: the table's own, radians, (N,), None where they are not known. They determine its
    angle 0 and its direction; backlash does no harm. The order of the images does not matter,
    except that without angles the first is at 0. Raises DataError where there are too few images,
    or they contradict the angles.
    """
    if len(seen) < FEWEST_IMAGES:
        raise DataError(f'too few images: expected {FEWEST_IMAGES} images of the turning board or '
                        f'more, got {len(seen)}', 'too_few_images')
    poses = np.stack([board_pose(lens, one) for one in seen])
    axis = find_axis(poses)
    table = _table_frame(axis.up, axis.center, poses[0])
    board = np.linalg.inv(table) @ poses[0]
    tilt = parameters_of(board @ _FACE_UP)[:2]
    start = np.concatenate([parameters_of(table), tilt, board[:2, 3], axis.turned[1:]])

    def parts(parameters: NDArray[np.float64]
              ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        # The board's corner is put at z 0 and its edge along x, which the axis does not determine
        board = rigid(np.append(parameters[6:8], 0), np.append(parameters[8:10], 0)) @ _FACE_UP
        return rigid(parameters[:3], parameters[3:6]), board, np.append(0, parameters[10:])

    def board_poses(parameters: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        table, board, turned = parts(parameters)
        return [table @ _about_z(angle) @ board for angle in turned]

    own = np.eye(len(seen), dtype=bool)[:, 1:]  # of the angles, an image tells of its own alone
    found = fit(seen, lens, board_poses, start, np.hstack([np.ones((len(seen), 10), bool), own]))
    images = fitted_images(seen, lens, board_poses(found))
    table, board, turned = parts(found)
    if angles is None:
        return TurntableFit(table, board, turned, None, None, images)
    fitted = compare_angles(turned, angles, [one.name for one in seen])
    return TurntableFit(table @ _about_z(fitted.offset), board, turned - fitted.offset,
                        fitted.direction, fitted.off, images)


def _table_frame(up: NDArray[np.float64], center: NDArray[np.float64],
                 board: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return camera from table, (4, 4); the table's x is along the board's edge."""
    edge = board[:3, 0] - up * (up @ board[:3, 0])
    edge /= np.linalg.norm(edge)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([edge, np.cross(up, edge), up], axis=1)
    frame[:3, 3] = center
    return frame


def _about_z(angle: float) -> NDArray[np.float64]:
    return rigid(np.array([0, 0, angle]), np.zeros(3))
