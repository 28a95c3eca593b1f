"""`active-recon report`: writes recorded runs to one self-contained HTML page."""

from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_options import with_bag_options
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.run import RecordedRun
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics
    from active_recon.report.subject import Subject
    from active_recon.report.truth import TruthFile


@with_bag_options
def report(
    bags: Annotated[list[Path], typer.Argument(
        metavar='BAG', help='rosbag2 folders, or MCAP or sqlite3 files. Several are shown side '
                            'by side.')],
    topics: 'Topics',
    scene: 'Scene',
    out: Annotated[Path | None, typer.Option(
        help='HTML file; default: report.html in the first bag, or BAG.html beside it if it is a '
             'file.')] = None,
    truth: Annotated[list[Path] | None, typer.Option(
        help='True shape of the object, for the IoU: a mesh file in metres in the object frame, '
             'a .binvox file, or bed, car, chair, sofa, table; one for all bags, or one for each '
             'bag in the same order. Not needed for bags of the demo.')] = None,
    fit: Annotated[bool, typer.Option(
        '--fit', help='Centre the true shape, scale its longest side to that of the cube, and '
                      'rotate it by the object yaw of the run.')] = False,
    up: Annotated[str | None, typer.Option(
        help="Axis of the true mesh's file that points up: x, y, z, with or without a sign. "
             'Default: y for glTF and GLB, z for others.')] = None,
    front: Annotated[str | None, typer.Option(
        help="Axis of the true mesh's file that points to the object's front. Default: z for "
             'glTF and GLB, x for others.')] = None,
    episode: Annotated[int | None, typer.Option(
        min=1, help='Only this episode of each bag, counted from 1; default: all with '
                    'views.')] = None,
    model: Annotated[str | None, typer.Option(
        help='Model for bags without reconstructions: its name, or a .safetensors file.',
    )] = None,
) -> None:
    """
    Write recorded runs as one HTML page that opens in any browser, offline.

    It shows the shape after each view in 3D, the images around the turntable, the planner's
    scores, entropy and IoU, the latency of each stage, and all warnings.

    Example: active-recon report bags/2026-11-21_10-00-00 --out run.html
    """
    from active_recon.bags.runs.reading import read_run
    from active_recon.report.page import report_page, write_page
    from active_recon.report.truth import TruthFile

    truths = truth or []
    if len(truths) not in (0, 1, len(bags)):
        raise ConfigError('--truth: wrong number of files: expected one for all bags, or one for '
                          f'each of {len(bags)}, got {len(truths)}')
    if not truths and (fit or up or front):
        raise ConfigError('--fit, --up and --front need --truth: give it too')
    files = [TruthFile(each, fit, up, front) for each in truths]
    first = bags[0]
    path = out or (first / 'report.html' if first.is_dir() else first.with_suffix('.html'))
    subjects: list[Subject] = []
    with progress_bar('reading', len(bags)) as advance:
        for index, bag in enumerate(bags):
            named = files[index if len(files) > 1 else 0] if files else None
            subjects += _subjects(
                read_run(bag, topics, scene), scene, named, episode, model, len(subjects))
            advance(1, bag.name)
    for subject in subjects if files else ():
        ious = ' '.join(f'{value:.2f}' for value in subject.ious if value is not None)
        typer.echo(f'{subject.letter}: IoU {ious}. {subject.placed}')
    write_page(report_page(subjects), path)
    typer.echo(f'wrote {path} ({path.stat().st_size / 1e6:.1f} MB)')


def _subjects(run: 'RecordedRun', scene: 'Scene', truth: 'TruthFile | None', episode: int | None,
              model: str | None, before: int) -> list['Subject']:
    """Return the episodes of a run for the page; their letters follow those of `before` others."""
    from itertools import islice

    from active_recon.bags.runs.rebuilt import rebuilt
    from active_recon.models.weights_files import find_weights
    from active_recon.report.subject import letters, Subject
    from active_recon.report.truth import known_truth

    if episode is not None and episode > len(run.episodes):
        raise ConfigError(f'--episode: {run.path} has no episode {episode}: expected 1 to '
                          f'{len(run.episodes)}')
    run, computed = rebuilt(run, scene, find_weights(model) if model else None)
    true = (known_truth(run) if truth is None
            else truth.read(run, scene.object_size, scene.object_yaw))
    cells, placed = (true.cells, true.placed) if true else (None, '')
    episodes = run.episodes if episode is None else run.episodes[episode - 1:episode]
    shown = [each for each in episodes if each.views]
    return [Subject(letter, run, each, cells, computed, placed)
            for letter, each in zip(islice(letters(), before, None), shown, strict=False)]
