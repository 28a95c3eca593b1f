"""`active-recon study`: compares networks on the same posed views."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.bf16_option import Bf16, in_bf16
from active_recon.cli.command_line import command_line
from active_recon.cli.needed_options import refuse_idle, refuse_lone
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import print_left_out
from active_recon.cli.runtime_option import MeasuredIn
from active_recon.cli.study_files import require_writable_study, write_study
from active_recon.errors import ConfigError
from active_recon.models.weights_files import DEFAULT_MODEL, PAPER_MODEL, SMALL_MODEL
import typer

if TYPE_CHECKING:
    from active_recon.datasets.middlebury import PosedPhotographs

_SHIPPED = (DEFAULT_MODEL, SMALL_MODEL, 'carving', PAPER_MODEL)


def study(
    context: typer.Context,
    data: Annotated[list[Path] | None, typer.Argument(
        help="Folders of objects in R2N2's layout (for example made by `active-recon render` or "
             '`dataset build`); each is measured separately.')] = None,
    models: Annotated[str | None, typer.Option(
        help='Networks, separated by commas: models that ship, .safetensors files, or NAME=FILE. '
             'The first is compared with each of the others, object by object. Default: '
             f'{",".join(_SHIPPED)}.')] = None,
    photos: Annotated[Path | None, typer.Option(
        help="Folder of calibrated photographs in Middlebury's format: *_par.txt with the "
             'cameras, README.txt with the two corners of the bounding box, and masks/ with a '
             'mask for each image if the background is not black. The reference is the visual '
             'hull of all masks.')] = None,
    box: Annotated[str | None, typer.Option(
        help='Bounding box of the photographed object, if the folder has none: minimum x, y, z '
             'and maximum x, y, z, six numbers in quotes.')] = None,
    up: Annotated[str, typer.Option(
        help="Axis of the photographs' frame that points up: x, y, z, with or without a "
             'sign.')] = 'y',
    counts: Annotated[str, typer.Option(
        help='Numbers of views after which the reconstruction is measured.')] = '1,2,3,5,8,12,24',
    surfaces: Annotated[str | None, typer.Option(
        help='Numbers of views, out of --counts, after which the mesh is compared with the true '
             "one: F-scores, Chamfer distance, normals. '' skips this. Default: those of 1,5 that "
             'are in --counts.')] = None,
    validation: Annotated[Path | None, typer.Option(
        help='Folder of other objects, on which thresholds and temperatures are chosen; default: '
             "the threshold in each model's card, and no temperature.")] = None,
    training: Annotated[list[Path] | None, typer.Option(
        help='Training folder: also measure the nearest training image as a baseline (may be '
             'given several times).')] = None,
    objects: Annotated[int | None, typer.Option(
        min=2, help='Largest number of objects of a folder, drawn at random; default: '
                    'all.')] = None,
    category: Annotated[str | None, typer.Option(
        help="Only objects of categories that match this pattern: 'thing_*', or '!thing_*' for "
             'all others.')] = None,
    disturbed_views: Annotated[int, typer.Option(
        min=0, help='Number of views in the robustness tests: rotated object frames, poses off '
                    'by 2 degrees, a third of the cube outside of an image, a single band of '
                    'elevations. 0 skips them.')] = 5,
    disturbed_objects: Annotated[int, typer.Option(
        min=1, help='Largest number of objects in the robustness tests.')] = 48,
    out: Annotated[Path, typer.Option(
        help='Folder for study.json, study.md and a PNG file for each set.')] = Path('study'),
    seed: Annotated[int, typer.Option(min=0, help='Seed of objects, views and disturbances.')] = 0,
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    runtime: MeasuredIn = 'torch',
) -> None:
    """
    Compare networks on the same posed views, by number of views, with 95 % intervals.

    Measured are: IoU at 64 and 32 cells after random and evenly spread views; mesh quality, thin
    parts, calibration near the surface, and the gain of a threshold chosen for each object;
    robustness to disturbed views; and IoU on real photographs. Networks that need no front
    (lifting, carving) accept any cameras; those of the paper are measured on turntables only.

    Example: active-recon study data/val --models lifting,carving --out build/val

    Example: active-recon study --photos photos/dino_sparse_ring --models
    new=runs/weights.safetensors
    """
    from active_recon.datasets.layout import list_objects, needed_objects
    from active_recon.evaluation.posed.entrants import load_entrants
    from active_recon.evaluation.posed.measuring import Plan
    from active_recon.evaluation.posed.retrieval import read_library
    from active_recon.evaluation.posed.scene import chosen_folders
    from active_recon.evaluation.posed.study import choose_on, Extent, study_set
    import torch

    if not data and photos is None:
        raise ConfigError('study: nothing to measure: expected folders of objects, or --photos '
                          'with a folder of photographs, got neither')
    refuse_lone(context, '--photos', photos is not None, 'box', 'up')
    refuse_idle(context, 'with --photos alone', not data, 'surfaces', 'training', 'category',
                'disturbed_views', 'disturbed_objects',
                *([] if validation else ['counts', 'objects']))
    torch.set_num_threads(threads)
    plan = Plan(_numbers('counts', counts),
                _numbers('surfaces', '1,5' if surfaces is None else surfaces), seed, in_bf16(bf16))
    if surfaces is not None and not set(plan.surfaces) <= set(plan.counts):
        raise ConfigError('surfaces: not measured: expected numbers of views out of --counts '
                          f'{counts}, got {surfaces}')
    extent = Extent(category, objects, disturbed_views, disturbed_objects)
    entrants = load_entrants(models or _those_that_ship(), runtime, plan.bfloat16, threads)
    if validation is not None and any(validation.resolve() == each.resolve()
                                      for each in data or []):
        raise ConfigError('validation: same objects twice: expected other objects than those '
                          f'measured, got {validation} for both')
    for folder in data or []:
        chosen_folders(needed_objects(folder), category)
    for folder in (*([] if validation is None else [validation]), *(training or [])):
        list_objects(folder)
    photographs = None if photos is None else _read_photographs(photos, box, up)
    require_writable_study(out, 'study')  # all of this is told before hours of measuring
    if validation is not None:
        entrants = choose_on(validation, entrants, plan, Extent(most=objects), progress_bar)
    library = None
    if training and data:
        folders = [folder for root in training for folder in list_objects(root)]
        with progress_bar('reading training images', len(folders)) as advance:
            library = read_library(folders, lambda done: advance(done, ''))
        print_left_out('training images', len(library.folders), (), library.unreadable)
    result: dict[str, Any] = {'command': command_line(),
                              'sets': []}
    for folder in data or []:
        found = study_set(folder, entrants, plan, extent, library, progress_bar)
        print_left_out(folder.name, found['objects'], (), found['unreadable'])
        if beyond := [str(count) for count in plan.counts if count > found['views']]:
            typer.echo(f'{folder}: not measured after {", ".join(beyond)} views: its objects have '
                       f'{found["views"]}', err=True)
        result['sets'].append(found)
        _write(result, out)  # keeps the results if a later folder fails
    if photographs is not None:
        result['photographs'] = _photograph_figures(photographs, entrants)
    for path in _write(result, out):
        typer.echo(f'wrote {path}')


def _those_that_ship() -> str:
    from active_recon.models.weights_files import FOLDER

    return ','.join(name for name in _SHIPPED if (FOLDER / f'{name}.safetensors').is_file())


def _numbers(option: str, text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(',') if part.strip())
    except ValueError as error:
        raise ConfigError(f'{option}: invalid list: expected whole numbers, separated by commas, '
                          f'got {text!r}') from error


def _read_photographs(folder: Path, box: str | None, up: str) -> 'PosedPhotographs':
    from active_recon.datasets.middlebury import read_photographs

    try:
        corners = None if box is None else [float(part) for part in box.replace(',', ' ').split()]
    except ValueError as error:
        raise ConfigError(f'box: invalid corners: expected six numbers, got {box!r}') from error
    return read_photographs(folder, corners, up)


def _photograph_figures(photographs: 'PosedPhotographs', entrants: list[Any]) -> dict[str, Any]:
    from active_recon.evaluation.posed.photographs import BACKGROUNDS, photograph_figures

    with progress_bar('photographs', len(entrants) * len(BACKGROUNDS)) as advance:
        return photograph_figures(photographs, entrants, advance=lambda done: advance(done, ''))


def _write(result: Mapping[str, Any], out: Path) -> list[Path]:
    """Write all files, and return their paths."""
    from active_recon.evaluation.posed.summary import markdown

    written = write_study(result, markdown(result), out, 'study')
    for number, figures in enumerate(result['sets']):
        written.append(out / f'study-{number}-{Path(figures["data"]).name}.png')
        _draw(figures, written[-1])
    return written


def _draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw IoU over the number of views, for each number of cells, random and even, with bands."""
    from active_recon.evaluation.statistics import Interval
    from active_recon.paper.plotting import canvas, curves, drawn
    from active_recon.png_files import write_png

    sides = [side for side in figures['cells']
             if any(f'iou_{side}' in own['even'] for own in figures['models'].values())]
    with canvas(5.5 * len(sides), 7, columns=len(sides), rows=2) as (figure, grid):
        for row, kind in enumerate(('random', 'even')):
            for axes, side in zip(grid[row], sides, strict=True):
                lines = {model: [Interval(each['mean'], each['low'], each['high'])
                                 for each in own[kind][f'iou_{side}'] if each is not None]
                         for model, own in figures['models'].items()
                         if f'iou_{side}' in own[kind]}
                curves(axes, figures['counts'], lines, f'{kind} views', f'IoU at {side} cells')
        figure.suptitle(f'{Path(figures["data"]).name}: {figures["objects"]} objects')
        picture = drawn(figure)
    write_png(path, picture[..., ::-1])
