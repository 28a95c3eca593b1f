"""`active-recon reconstruct`: an object from photos with known cameras, without ROS."""

import math
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.calibrate import printed_board
from active_recon.cli.needed_options import refuse_lone
from active_recon.cli.number_lists import box_numbers
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError, RecordingError
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.parameters.viewer import DEFAULT_PORT, HIGHEST_PORT
import typer

if TYPE_CHECKING:
    from active_recon.photos.shape import Shape
    from active_recon.photos.sources import Source


def reconstruct(
    context: typer.Context,
    photos: Annotated[Path, typer.Argument(
        help='Folder of photos; or a video around the object, with --sfm or --board.',
        show_default=False)],
    out: Annotated[Path, typer.Option(
        help='Folder for mesh, voxels, picture and shape.json.')] = Path('reconstruction'),
    cameras: Annotated[Path | None, typer.Option(
        help='Cameras: transforms.json (NeRF, instant-ngp, nerfstudio), the folder of a COLMAP '
             'model, *_par.txt (Middlebury), or YAML, XML or JSON of OpenCV. Default: the one '
             'beside the photos.'),
    ] = None,
    axes: Annotated[str | None, typer.Option(
        help='Camera axes of the file, opencv or opengl, instead of those of its format.')] = None,
    board: Annotated[bool, typer.Option(
        '--board', help='The board of `calibrate --print-board` is in the photos and gives their '
                        'cameras.')] = False,
    squares: Annotated[str, typer.Option(help='Squares of the board, COLUMNSxROWS.')] = '7x5',
    square_mm: Annotated[float, typer.Option(
        help='Side of a square, measured on the printed board.')] = 30.0,
    marker_mm: Annotated[float | None, typer.Option(
        help='Side of a marker; default: 3/4 of a square.')] = None,
    dictionary: Annotated[str, typer.Option(help='ArUco dictionary of the markers.')] = '4x4_50',
    camera_info: Annotated[Path | None, typer.Option(
        help="With --board: lens in the YAML format of ROS's camera_calibration; default: "
             'estimated from the photos.')] = None,
    sfm: Annotated[bool, typer.Option(
        '--sfm', help='Find the cameras from the photos alone, by structure from motion: 15 or '
                      'more around the object, at most 20 degrees apart, with the object on '
                      'something finely patterned. COLMAP does it (pip install '
                      "'active_recon[sfm]'). Give --size: photos tell no scale.")] = False,
    turntable_step_deg: Annotated[float | None, typer.Option(
        help='The photos, in their order, show a turntable that turns by this angle between them, '
             'counter-clockwise seen from above, before a fixed camera.')] = None,
    elevation_deg: Annotated[float, typer.Option(
        help="With a turntable: the camera's angle above the horizon.")] = 30.0,
    distance: Annotated[float | None, typer.Option(
        help='With a turntable: from the camera to the point on the axis that it looks at, '
             'metres.', show_default=False)] = None,
    fov_deg: Annotated[float | None, typer.Option(
        help='With a turntable: horizontal field of view; default: by EXIF.')] = None,
    box: Annotated[str | None, typer.Option(
        help="The object's cube, x,y,z,side in units of the cameras; default: as the cameras' "
             'file says, else found.')] = None,
    unit: Annotated[float, typer.Option(help='Metres in a unit of the cameras.')] = 1.0,
    size: Annotated[float | None, typer.Option(
        help='Side of the cube in metres, where the unit is not known.')] = None,
    up: Annotated[str | None, typer.Option(
        help="Axis of the cameras' world that points up, e.g. z or -y. Default: by the "
             'format.')] = None,
    ground: Annotated[bool, typer.Option(
        help='Find the table under the object by its texture: nothing in or under it is the '
             'object.')] = True,
    background: Annotated[str, typer.Option(
        help='auto (masks, alpha, the network before a plain background, else segment), plain '
             '(by the colour of a plain background), network, segment (by a learned segmenter), '
             'grabcut, or rembg (if installed).')] = 'auto',
    masks: Annotated[Path | None, typer.Option(
        help='With --background auto: folder of masks named like the photos, bright on the '
             'object.')] = None,
    views: Annotated[int | None, typer.Option(
        min=1, help='Use so many photos at even steps; default: all.')] = None,
    frames: Annotated[int | None, typer.Option(
        min=1, help='With a video: take so many frames, the sharpest of parts of equal length; '
                    'default: 36, one every ten degrees.')] = None,
    order: Annotated[str, typer.Option(
        help='Order of the photos: name, or time (when they were taken, by EXIF).')] = 'name',
    mesh_format: Annotated[str, typer.Option(
        help='ply, obj, stl, glb, or urdf: a robot description.')] = 'ply',
    bag: Annotated[bool, typer.Option(
        '--bag', help='Also write the bag of the run, for replay, and its report.')] = False,
    model: Annotated[str, typer.Option(
        help='A model that ships, by its name, or a .safetensors file; lifting takes less '
             'time.')] = DEFAULT_MODEL,
    watch: Annotated[bool, typer.Option(
        '--watch', help='Take photos in as they arrive in the folder, and show on a page where '
                        'to stand next, until Ctrl-C.')] = False,
    lan: Annotated[bool, typer.Option(
        '--lan', help='With --watch: a phone in the local network may send photos, to an address '
                      'that nobody can guess. Default: this machine only.')] = False,
    port: Annotated[int, typer.Option(
        min=0, max=HIGHEST_PORT, help='With --watch: port of the page with the shape, or the next '
                                      'free one.')] = DEFAULT_PORT,
    max_views: Annotated[int, typer.Option(
        min=1, help='With --watch: photos after which there are enough.')] = 12,
    target_quality: Annotated[float, typer.Option(
        min=0, max=0.99, help='With --watch: there are enough when this IoU is promised, or out '
                              'of reach; 0 for no target.')] = 0.0,
    min_gain: Annotated[float, typer.Option(
        min=0, max=0.99, help='With --watch: there are enough when no photo is expected to gain '
                              'as much of IoU.')] = 0.005,
) -> None:
    """
    Reconstruct an object from a folder of photos, or from a video.

    No ROS runs, nothing has to be cropped, and masks are not needed. The cameras come from a file,
    from a printed board in the photos, from the steps of a turntable, or from the photos alone.
    What is wrong with a photo is said in one line, and the others are used.

    Example: active-recon reconstruct photos/ --cameras transforms.json --out mug

    Example: active-recon reconstruct photos/ --board --size 0.2

    Example: active-recon reconstruct photos/ --sfm --size 0.2

    Example: active-recon reconstruct film.mp4 --sfm --size 0.2

    Example: active-recon reconstruct photos/ --watch --board --lan
    """
    from active_recon.photos.options import FRAMES, Options
    from active_recon.photos.reconstruct import from_files
    from active_recon.photos.saving import FORMATS, of_earlier_run, save_shape
    from active_recon.photos.sources import BoardCameras, SfmCameras, TurntableCameras
    from active_recon.photos.video_frames import is_video

    if mesh_format not in FORMATS:
        raise ConfigError(f'--mesh-format: unknown value: expected {", ".join(FORMATS)}, got '
                          f'{mesh_format!r}')
    if size is not None and unit != 1.0:
        raise ConfigError('--size and --unit both set the scale: give one of them')
    refuse_lone(context, '--board', board,
                'squares', 'square_mm', 'marker_mm', 'dictionary', 'camera_info')
    refuse_lone(context, '--turntable-step-deg', turntable_step_deg is not None,
                'elevation_deg', 'distance', 'fov_deg')
    refuse_lone(context, '--watch', watch,
                'lan', 'port', 'max_views', 'target_quality', 'min_gain')
    folder = out / 'bag'
    if bag and folder.exists():
        raise RecordingError(f'{folder}: already there: expected a new folder; give another --out',
                             'bag_not_begun')
    sources: list[Source] = []
    if cameras is not None:
        sources.append(cameras)
    if board:
        sources.append(BoardCameras(
            printed_board(squares, square_mm, marker_mm, dictionary), camera_info))
    if turntable_step_deg is not None:
        if distance is None:
            raise ConfigError('--turntable-step-deg needs --distance: give it in metres')
        sources.append(TurntableCameras(
            math.radians(turntable_step_deg), math.radians(elevation_deg), distance,
            None if fov_deg is None else math.radians(fov_deg)))
    if sfm:
        sources.append(SfmCameras())
    for option, given in (('--board', board), ('--sfm', sfm),
                          ('--turntable-step-deg', turntable_step_deg is not None)):
        if given and axes is not None:
            raise ConfigError(f'--axes with {option}: it is for a file of cameras')
    refuse_lone(context, 'a video', is_video(photos), 'frames')
    if out.resolve() == photos.resolve():
        raise ConfigError(f'--out: the folder of photos, {out}: its picture.png would be a photo '
                          'of the next run; give another folder')
    if out.exists() and not out.is_dir():
        raise ConfigError(f'--out: no folder: expected one, or a name for a new one, got the file '
                          f'{out}')
    if len(sources) > 1:
        raise ConfigError('several of --cameras, --board, --turntable-step-deg and --sfm: give '
                          'one of them')
    source = sources[0] if sources else None
    options = Options(None if box is None else box_numbers(box), unit, size, up, axes, background,
                      masks, views, model, order=order, ground=ground,
                      frames=FRAMES if frames is None else frames)
    if watch:
        from active_recon.cli.watch_photos import Pages, watch_photos
        from active_recon.policies.stopping import StoppingRule

        if views is not None:
            raise ConfigError('--views with --watch: every photo that arrives is used; '
                              '--max-views tells when there are enough')
        if order != 'name':
            raise ConfigError('--order with --watch: photos are taken in as they arrive')
        shape = watch_photos(photos, source, options, StoppingRule(
            max_views, target_quality=target_quality, min_gain=min_gain), Pages(port, lan))
    else:
        shape = from_files(photos, source, options, progress_bar)
    _print(shape)
    paths, missing = save_shape(shape, out, mesh_format)
    if missing:
        typer.echo(missing)
    for path in paths:
        typer.echo(f'wrote {path}')
    if bag:
        page = out / 'report.html'
        _write_bag(shape, folder, page)
        paths += [folder, page]
    for path in of_earlier_run(out, paths):
        typer.echo(f'{path} is of an earlier run, not of this shape', err=True)


def _print(shape: 'Shape') -> None:
    from active_recon.report.words import counted

    for reason in shape.left_out:
        typer.echo(f'left out: {reason}', err=True)
    for warning in shape.warnings:
        typer.echo(f'warning: {warning}', err=True)
    side = shape.cube
    stands = '' if shape.ground is None else ', on the ground that was found'
    deep = sum(view.depth is not None for view in shape.views)
    typer.echo(f'{counted(len(shape.views), "photo")}{f", {deep} with depth" if deep else ""}; '
               f'silhouettes: {shape.background}; cube of {shape.size:.4g} m about '
               f'{", ".join(f"{value:.4g}" for value in side.centre)}{stands}')
    if shape.quality is not None:
        typer.echo(f'quality: {shape.quality.summary}')


def _write_bag(shape: 'Shape', folder: Path, page: Path) -> None:
    from active_recon.bags.runs.photo_run import photo_run
    from active_recon.bags.runs.run_writing import write_run
    from active_recon.report.page import report_page, write_page
    from active_recon.report.subject import Subject

    run = photo_run(shape, folder)
    write_run(run, folder)
    typer.echo(f'wrote {folder}')
    write_page(report_page([Subject('A', run, run.episodes[0])]), page)
    typer.echo(f'wrote {page}')
