"""`active-recon batch`: archives of bags, replayed, reported or measured into one table."""

from collections.abc import Callable
from functools import partial
import inspect
from pathlib import Path
import time
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_options import with_bag_options
from active_recon.cli.cluster_option import Cluster, Workers, workers_of
from active_recon.cli.policy_option import policy_option
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError, DataError
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics
    from active_recon.batch.task import TruthSource

batch = typer.Typer(help='Archives of bags: one table and one page for all of them.',
                    no_args_is_help=True)

_EXPLAINED = {
    'measure': """
        Measure all bags of an archive: views, quality, IoU if the truth is known, and why each
        stopped.

        Bags without reconstructions are reconstructed from their images, all of them with
        --model, --policy or --threshold.
    """,
    'replay': """
        Replay all bags of an archive, and compare each with its recording.

        With --model, --policy or --threshold nothing is compared: the rows tell what would have
        been. No bags are written.
    """,
    'report': """
        Write a report of each bag of an archive, and measure all of them.
    """,
}
_ALL = """

    OUT/table.parquet gets a row for each episode, and one for each bag that is refused, with the
    reason; OUT/summary.html the plots and links. A second start with the same OUT keeps the bags
    that are finished and unchanged. The results do not depend on the workers: processes of this
    machine, or a Ray cluster (--cluster), whose machines must see the bags and OUT at the same
    paths or URLs. The exit code is 2 where all bags are refused.

    Example: active-recon batch {kind} archive 'fleet/**/*.mcap' --out build/batch
"""


def _work(
    kind: str,
    bags: Annotated[list[str], typer.Argument(
        metavar='BAGS...', help='Bags, folders of bags at any depth, or patterns: paths, or URLs '
                                'of file://, s3://, gs:// and az://.')],
    out: Annotated[str, typer.Option(
        metavar='DIR', help='Folder of the table, the page, the reports and the finished '
                            'results: a path, or a URL as for BAGS.')],
    topics: 'Topics',
    scene: 'Scene',
    model: Annotated[str | None, typer.Option(
        help='Reconstruct with another model: its name, or a weights file.')] = None,
    policy: Annotated[str | None, policy_option(
        'Choose among the recorded views with another policy; a bag without a view that it asks '
        'for is refused.')] = None,
    threshold: Annotated[float | None, typer.Option(
        help='Another occupancy threshold.')] = None,
    truth: Annotated[str | None, typer.Option(
        help='True shape of the objects, for the IoU: a file as for `active-recon report`, or a '
             'folder with a file for each object, by its name. Not needed for bags of the '
             'demo.')] = None,
    fit: Annotated[bool, typer.Option(
        '--fit', help='Centre the true shapes, scale their longest sides to that of the cube, '
                      'and rotate them by the object yaw of the run.')] = False,
    up: Annotated[str | None, typer.Option(
        help="Axis of the true meshes' files that points up: x, y, z, with or without a "
             'sign.')] = None,
    front: Annotated[str | None, typer.Option(
        help="Axis of the true meshes' files that points to the object's front.")] = None,
    cluster: Cluster = None,
    workers: Workers = None,
) -> None:
    from active_recon.bags.runs.loop_setup import Overrides
    from active_recon.batch.finding import find_roots, place_of
    from active_recon.batch.run import run_batch, SUMMARY
    from active_recon.batch.table import TABLE
    from active_recon.batch.task import Task
    from active_recon.models.weights_files import find_weights

    if truth is None and (fit or up or front):
        raise ConfigError('--fit, --up and --front need --truth: give it too')
    if threshold is not None and not 0 < threshold < 1:
        raise ConfigError(f'--threshold: out of range: expected one in (0, 1), got {threshold:g}')
    weights = find_weights(model).absolute() if model else None
    task = Task(kind, place_of(out), topics, scene, Overrides(weights, policy, threshold),
                _truth(truth, fit, up, front))
    roots = find_roots(bags)
    begun = time.monotonic()
    with workers_of(cluster, workers) as crew:
        counts = run_batch(task, roots, crew, progress_bar)
    took = time.monotonic() - begun
    before = f', {counts.kept} of them finished before' if counts.kept else ''
    typer.echo(f'{counts.bags} bag{"s" if counts.bags != 1 else ""} in {took:.0f} s{before}; '
               f'{counts.refused} refused')
    for reason in counts.reasons:
        typer.echo(f'refused: {reason}', err=True)
    if more := counts.refused - len(counts.reasons):
        typer.echo(f'refused: {more} more; {TABLE} and {SUMMARY} tell why', err=True)
    for name in (TABLE, SUMMARY):
        typer.echo(f'wrote {task.out / name}')
    if counts.refused == counts.bags:
        raise typer.Exit(2)


def _truth(truth: str | None, fit: bool, up: str | None, front: str | None
           ) -> 'TruthSource | None':
    from active_recon.batch.finding import path_of
    from active_recon.batch.task import TruthSource
    from active_recon.objects import find_object, shipped_objects

    if truth is None:
        return None
    if truth in shipped_objects():
        return TruthSource(Path(truth), fit, up, front)
    path = path_of('--truth', truth)
    if not path.exists():
        raise DataError(f'--truth: {truth}: expected a file, a folder, or one of '
                        f'{", ".join(shipped_objects())}')
    return TruthSource(path if path.is_dir() else find_object(str(path)), fit, up, front)


def _command(kind: str) -> Callable[..., None]:
    """Return the subcommand of a kind."""
    own = inspect.signature(_work)
    command = partial(_work, kind)

    def run(**values: object) -> None:
        command(**values)  # type: ignore[arg-type]

    run.__signature__ = own.replace(  # type: ignore[attr-defined]
        parameters=[each for name, each in own.parameters.items() if name != 'kind'])
    run.__name__ = kind
    run.__doc__ = inspect.cleandoc(_EXPLAINED[kind]) + inspect.cleandoc(
        _ALL).join(('\n\n', '')).format(kind=kind)
    return with_bag_options(run)


for _kind in _EXPLAINED:
    batch.command(_kind)(_command(_kind))
