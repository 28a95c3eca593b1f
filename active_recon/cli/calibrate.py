"""`active-recon calibrate`: estimates the pose of the camera from images of a board."""

import math
from pathlib import Path
from shlex import quote
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.needed_options import refuse_lone
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.calibration.board import Board


def calibrate(
    context: typer.Context,
    images: Annotated[list[Path] | None, typer.Argument(
        help='Images of the board, or folders of them.', show_default=False)] = None,
    object_size: Annotated[float | None, typer.Option(
        help="Side of the object's cube, metres.", show_default=False)] = None,
    out: Annotated[Path, typer.Option(
        help='Output folder for calibration.yaml, calibration.png and camera_info.yaml.'
    )] = Path('calibration'),
    print_board: Annotated[Path | None, typer.Option(
        help='Write the board as a PNG file, to be printed at its true size, and exit.')] = None,
    squares: Annotated[str, typer.Option(
        help='Number of squares of the board, COLUMNSxROWS.')] = '7x5',
    square_mm: Annotated[float, typer.Option(
        help='Side of a square, measured on the printed board.')] = 30.0,
    marker_mm: Annotated[float | None, typer.Option(
        help='Side of a marker; default: 3/4 of a square.')] = None,
    dictionary: Annotated[str, typer.Option(
        help='ArUco dictionary of the markers, e.g. 5x5_100.')] = '4x4_50',
    board_thickness_mm: Annotated[float, typer.Option(
        help='Height of the printed face above the plate.')] = 0.0,
    step_deg: Annotated[float | None, typer.Option(
        help='Rotation of the turntable between consecutive images, sorted by name; the first '
             'is at 0.')] = None,
    angles_deg: Annotated[Path | None, typer.Option(
        help='CSV file of the turntable angles, with the columns image, degrees.')] = None,
    camera_azimuth_deg: Annotated[float, typer.Option(
        help='Azimuth of the camera at turntable angle 0. With 0, the front of the object faces '
             'the camera there.')] = 0.0,
    poses: Annotated[Path | None, typer.Option(
        help="For an arm instead of a turntable: CSV file of the poses of the camera's mount in "
             'the base frame, with the columns image, x, y, z, qx, qy, qz, qw (metres).')] = None,
    camera_info: Annotated[Path | None, typer.Option(
        help="Lens parameters in the YAML format of ROS's camera_calibration; default: "
             'estimated from the images.')
    ] = None,
    lens_images: Annotated[list[Path] | None, typer.Option(
        help='More images of the board at various tilts, or folders of them, to estimate the '
             'lens parameters.')] = None,
    base_frame: Annotated[str, typer.Option(help="tf frame of the arm's base.")] = 'base_link',
    mount_frame: Annotated[str, typer.Option(
        help="tf frame of the camera's mount, whose poses --poses gives.")] = 'tool0',
    camera_frame: Annotated[str, typer.Option(
        help="tf name of the camera's optical frame.")] = 'camera_optical_frame',
) -> None:
    """
    Calibrate a camera at a turntable, or on an arm, from images of a ChArUco board.

    Lay the board on the turntable and rotate it in steps in front of the fixed camera; or keep it
    in place and move the arm. The result is a ROS parameters file for the reconstructor and the
    view_planner.

    Example: active-recon calibrate --print-board board.png

    Example: active-recon calibrate images/ --step-deg 15 --object-size 0.25
    """
    refuse_lone(context, '--poses', poses is not None,
                'base_frame', 'mount_frame', 'camera_frame')
    board = printed_board(squares, square_mm, marker_mm, dictionary)
    if print_board is not None:
        board.save(print_board)
        width, height = board.printed_size()
        typer.echo(f'wrote {print_board}: print it at 100 %, not fitted to the page, and measure '
                   f'it: {board.columns} x {board.rows} squares are {width * 1e3:.1f} x '
                   f'{height * 1e3:.1f} mm. If they are not, give the side of a square by '
                   '--square-mm.')
        return
    if not images or object_size is None:
        raise ConfigError('no images of the board, or no --object-size: give both, or '
                          '--print-board')

    from active_recon.calibration.calibration import (
        BoardImages,
        calibrate_arm,
        calibrate_turntable,
        Frames,
    )
    from active_recon.calibration.files import image_paths, read_angles, read_poses
    from active_recon.calibration.placement import Placement

    if sum(one is not None for one in (step_deg, angles_deg, poses)) > 1:
        raise ConfigError('several of --step-deg, --angles-deg and --poses: give one of them')
    if step_deg is not None and not math.isfinite(step_deg):
        raise ConfigError(f'--step-deg: not finite: expected degrees, got {step_deg}')
    if out.resolve() in [place.resolve() for place in (*images, *(lens_images or ()))]:
        raise ConfigError(f'--out: a folder of images, {out}: its calibration.png would be an '
                          'image of the next run; give another folder')
    paths = image_paths(images)
    names = [path.name for path in paths]
    placement = Placement(
        object_size, board_thickness_mm / 1e3, math.radians(camera_azimuth_deg))
    seen = BoardImages(board, paths, camera_info, image_paths(lens_images) if lens_images else ())
    if poses is not None:
        found = calibrate_arm(seen, placement, read_poses(poses, names),
                              Frames(base_frame, mount_frame, camera_frame), progress_bar)
    else:
        angles = None if angles_deg is None else read_angles(angles_deg, names)
        if step_deg is not None:
            angles = {name: math.radians(step_deg) * index for index, name in enumerate(names)}
        found = calibrate_turntable(seen, placement, angles, progress_bar)
    found.save(out, paths)
    for one in found.images:
        typer.echo(f'{one.seen.name}: {len(one.seen.points)} corners, {one.error:.2f} pixels')
    for remark in found.remarks:
        typer.echo(f'note: {remark}')
    typer.echo(f'reprojection error {found.error:.2f} pixels (RMS), drawn in '
               f'{out / "calibration.png"}')
    for command in found.static_transforms():
        typer.echo(command)
    written = out / 'calibration.yaml'
    typer.echo(f'wrote {written}: ros2 run active_recon reconstructor --ros-args --params-file '
               f'{quote(str(written))}, and view_planner likewise')


def printed_board(squares: str, square_mm: float, marker_mm: float | None,
                  dictionary: str) -> 'Board':
    """Return the board of the options; raises ConfigError where there is no such board."""
    from active_recon.calibration.board import Board

    columns, rows = _squares(squares)
    marker = 0.75 * square_mm if marker_mm is None else marker_mm
    return Board(columns, rows, square_mm / 1e3, marker / 1e3, dictionary)


def _squares(words: str) -> tuple[int, int]:
    columns, _, rows = words.lower().partition('x')
    if not (columns.isdecimal() and rows.isdecimal()):
        raise ConfigError('--squares: invalid size of the board: expected COLUMNSxROWS, e.g. 7x5, '
                          f'got {words!r}')
    return int(columns), int(rows)
