"""`active-recon report`: recorded runs as one page that can be sent to anybody."""

from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_topics import with_topics
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.run import RecordedRun
    from active_recon.bags.topics import Topics
    from active_recon.report.subject import Subject


@with_topics
def report(
    bags: Annotated[list[Path], typer.Argument(
        metavar='BAG', help='rosbag2 folders, or MCAP or sqlite3 files. Several stand side by '
                            'side.')],
    topics: 'Topics',
    out: Annotated[Path | None, typer.Option(
        help='Where the page goes; default: report.html in the first bag.')] = None,
    truth: Annotated[list[Path] | None, typer.Option(
        help="The object's true shape for the IoU: a mesh, a .binvox or bed, car, chair, sofa, "
             'table; once for all bags, or once for each in their order. The demo needs '
             'none.')] = None,
    episode: Annotated[int | None, typer.Option(
        min=1, help='Only this episode of each bag, counted from 1; default: all with '
                    'views.')] = None,
    model: Annotated[str | None, typer.Option(
        help='What rebuilds the shapes where a bag holds none: a model that ships, or a '
             '.safetensors file.')] = None,
) -> None:
    """
    Write recorded runs as one HTML page that opens in any browser, with no network.

    It shows the shape after each view in 3D, the images around the turntable, what the planner
    thought, entropy and IoU, where the time went, and what went wrong.

    Example: active-recon report bags/2026-11-21_10-00-00 --out run.html
    """
    from active_recon.bags.reading import read_run
    from active_recon.report.page import report_page, write_page

    truths = truth or []
    if len(truths) not in (0, 1, len(bags)):
        raise ConfigError('--truth: expected one for all bags or one for each of '
                          f'{len(bags)}, got {len(truths)}')
    path = out or (bags[0] if bags[0].is_dir() else bags[0].parent) / 'report.html'
    subjects: list[Subject] = []
    with progress_bar('reading', len(bags)) as advance:
        for index, bag in enumerate(bags):
            named = truths[index if len(truths) > 1 else 0] if truths else None
            subjects += _subjects(read_run(bag, topics), named, episode, model, len(subjects))
            advance(1, bag.name)
    write_page(report_page(subjects), path)
    typer.echo(f'wrote {path} ({path.stat().st_size / 1e6:.1f} MB)')


def _subjects(run: 'RecordedRun', truth: Path | None, episode: int | None, model: str | None,
              before: int) -> list['Subject']:
    """Return the episodes of a run that the page shows, their letters after `before` others."""
    from itertools import islice

    from active_recon.report.subject import letters, Subject
    from active_recon.report.truth import (
        known_truth,
        lacks_reconstruction,
        read_truth,
        with_reconstruction,
    )

    computed = ''
    if lacks_reconstruction(run):
        from active_recon.reconstructor import Reconstructor
        from active_recon.weights_files import find_weights

        reconstructor = Reconstructor.load(find_weights(model))
        run = with_reconstruction(run, reconstructor)
        computed = f'the weights {reconstructor.provenance["weights_sha256"][:12]}'
    cells = known_truth(run) if truth is None else read_truth(truth, run)
    episodes = run.episodes if episode is None else run.episodes[episode - 1:episode]
    shown = [each for each in episodes if each.views]
    return [Subject(letter, run, each, cells, computed)
            for letter, each in zip(islice(letters(), before, None), shown, strict=False)]
