"""Complete calibrations, from images to the parameters of the nodes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from active_recon.calibration.arm import FEWEST_IMAGES as FEWEST_OF_ARM
from active_recon.calibration.arm import fit_arm
from active_recon.calibration.board import Board, detect_all, Detection
from active_recon.calibration.files import read_image
from active_recon.calibration.fit import ImageFit
from active_recon.calibration.lens import estimate_lens, read_lens
from active_recon.calibration.outcome import Calibration, quaternion_of
from active_recon.calibration.placement import Placement
from active_recon.calibration.remarks import (
    DIRECTION_UNKNOWN,
    LENS_HALF_KNOWN,
    of_angles,
    of_cube,
    of_elevation,
    of_errors,
    of_missing,
    SCALE_UNKNOWN,
)
from active_recon.calibration.turntable import FEWEST_IMAGES as FEWEST_OF_TABLE
from active_recon.calibration.turntable import fit_turntable
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.reporting import Advance, Reporting, silent
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Frames:
    """The names of an arm's tf frames."""

    base: str = 'base_link'
    mount: str = 'tool0'
    camera: str = 'camera_optical_frame'
    object: str = 'object'


@dataclass(frozen=True)
class BoardImages:
    """
    Images of a board.

    The lens parameters are read from the file `camera_info`; without it they are estimated from
    these images and from `lens_paths`, more images of the board in any pose.
    """

    board: Board
    paths: Sequence[Path]
    camera_info: Path | None = None
    lens_paths: Sequence[Path] = ()


@dataclass(frozen=True, eq=False)
class _Detections:
    seen: list[Detection]
    lens: Intrinsics
    remarks: list[str]


def calibrate_turntable(images: BoardImages, placement: Placement,
                        angles: Mapping[str, float] | None = None,
                        reporting: Reporting = silent) -> Calibration:
    """
    Estimate the pose of a fixed camera beside a turntable.

    `angles`: the table's angle in each image, by the image's name, radians; None where they are
    not known. Raises DataError where the images do not determine the pose or contradict the
    angles.
    """
    detected = _detect_board(images, FEWEST_OF_TABLE, reporting)
    given = None if angles is None else np.array([angles[one.name] for one in detected.seen])
    found = fit_turntable(detected.seen, detected.lens, given)
    pose = placement.on_table(found)
    camera = Camera(pose)
    reconstructor: dict[str, Any] = {
        'object_size': placement.object_size, 'pose_source': 'turntable_joint',
        'camera_position': _rounded(pose[:3, 3]),
        'camera_orientation': _rounded(quaternion_of(pose))}
    remarks = [*detected.remarks, *of_elevation(camera), *of_angles(found)]
    driver: dict[str, Any] = {'camera_azimuth_at_zero': round(placement.azimuth_at_zero, 6)}
    if found.direction is None:
        remarks.append(DIRECTION_UNKNOWN)
    else:
        for node in (reconstructor, driver):
            node['turntable_direction'] = found.direction
    planner = {'object_size': placement.object_size, 'elevation': round(camera.elevation, 5),
               'distance': round(camera.distance, 5)}
    object_from_board = pose @ found.camera_from_table @ found.table_from_board
    board_from_object = np.asarray(np.linalg.inv(object_from_board), np.float64)
    return _calibration(found.images, detected.lens, board_from_object, placement, remarks,
                        {'reconstructor': reconstructor, 'view_planner': planner,
                         'turntable_driver': driver}, {})


def calibrate_arm(images: BoardImages, placement: Placement,
                  mounts: Mapping[str, NDArray[np.float64]], frames: Frames,
                  reporting: Reporting = silent) -> Calibration:
    """
    Estimate the pose of a camera on an arm, and of the object frame in the arm's base frame.

    `mounts`: base from mount, (4, 4), metres, by the image's name. Raises DataError as `fit_arm`
    does.
    """
    detected = _detect_board(images, FEWEST_OF_ARM, reporting)
    found = fit_arm(detected.seen, detected.lens,
                    np.stack([mounts[one.name] for one in detected.seen]))
    remarks = detected.remarks if found.scale_known else [*detected.remarks, SCALE_UNKNOWN]
    board_from_object = placement.on_board(images.board)
    size: dict[str, Any] = {
        'object_size': placement.object_size, 'object_frame': frames.object}
    return _calibration(
        found.images, detected.lens, board_from_object, placement, remarks,
        {'reconstructor': {**size, 'pose_source': 'tf'}, 'view_planner': size},
        {(frames.base, frames.object): found.base_from_board @ board_from_object,
         (frames.mount, frames.camera): found.mount_from_camera})


def _detect_board(images: BoardImages, fewest: int, reporting: Reporting) -> _Detections:
    with reporting('searching the board', len(images.paths) + len(images.lens_paths)) as advance:
        seen, missing = _detect(images.board, images.paths, fewest, advance)
        more = (_detect(images.board, images.lens_paths, 1, advance)[0] if images.lens_paths
                else [])
    for other in more[:1]:
        _same_size(seen[0], other.size, other.name)
    remarks = of_missing(missing)
    if images.camera_info is not None:
        lens = read_lens(images.camera_info)
        _same_size(seen[0], (lens.width, lens.height), str(images.camera_info))
        return _Detections(seen, lens, remarks)
    estimated = estimate_lens([*seen, *more])
    if not estimated.whole:
        remarks.append(LENS_HALF_KNOWN)
    return _Detections(seen, estimated.lens, remarks)


def _detect(board: Board, paths: Sequence[Path], fewest: int, advance: Advance
            ) -> tuple[list[Detection], list[str]]:
    return detect_all(board, _read(paths, advance), fewest)


def _read(paths: Sequence[Path], advance: Advance) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    for path in paths:
        yield path.name, read_image(path)
        advance(1, path.name)  # once the board has been searched in it


def _same_size(first: Detection, size: tuple[int, int], name: str) -> None:
    if size != first.size:
        raise DataError(f'{name}: wrong image size: expected that of the other images, '
                        f'{first.size[0]} x {first.size[1]} of {first.name}, got {size[0]} x '
                        f'{size[1]}', 'image_size')


def _calibration(images: list[ImageFit], lens: Intrinsics, board_from_object: NDArray[np.float64],
                 placement: Placement, remarks: list[str],
                 parameters: Mapping[str, Mapping[str, Any]],
                 transforms: Mapping[tuple[str, str], NDArray[np.float64]]) -> Calibration:
    size = placement.object_size
    return Calibration(
        lens, images, board_from_object, size, parameters,
        [*remarks, *of_errors(images), *of_cube(images, lens, board_from_object, size)],
        transforms)


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [round(float(value), 6) for value in values]
