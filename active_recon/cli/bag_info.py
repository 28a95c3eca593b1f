"""`active-recon bag info`: the content of a bag, and whether it can be replayed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_options import with_bag_options
from active_recon.cli.progress import bag_progress
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.run import RecordedRun, RecordedView
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics
    from active_recon.bags.storage.bag import BagSummary


@with_bag_options
def info(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help='A rosbag2 folder, or an MCAP or sqlite3 file.')],
    topics: 'Topics',
    scene: 'Scene',
) -> None:
    """
    Show the content of a bag, and whether it can be replayed or what is missing for that.

    Bags of other recorders are read too: name the camera's topics if they are not found, and give
    by options what the bag lacks.

    Example: active-recon bag info drive.db3 --image /cam/color --azimuth /table/joints
    --object-size 0.16
    """
    from active_recon.bags.runs.description import describe_bag

    described = describe_bag(path, topics, scene, bag_progress(path))
    _print_contents(path, described.summary)
    if described.missing:
        typer.echo(f'cannot be replayed: {described.missing}')
    if described.run is not None:
        _print_run(described.run, not described.missing)


def _print_contents(path: Path, summary: 'BagSummary') -> None:
    messages = sum(topic.count for topic in summary.topics)
    typer.echo(f'{path}: {messages} messages in {(summary.end - summary.begin) / 1e9:.1f} s')
    for name, value in summary.provenance.items():
        typer.echo(f'  {name}: {value}')
    if summary.parameters:
        typer.echo(f'  parameters of {", ".join(sorted(summary.parameters))}')
    width = max((len(topic.name) for topic in summary.topics), default=0)
    for topic in summary.topics:
        typer.echo(f'  {topic.name:<{width}}  {topic.count:>6}  {topic.type_name}')


def print_refusals(run: 'RecordedRun') -> None:
    """Print which messages of a bag without a record of the loop were left out, and why."""
    from active_recon.report.words import refusals

    for refusal in refusals(run.counters.get('bag', {})):
        typer.echo(refusal)


def told_depth(views: 'Sequence[RecordedView]') -> str:
    """Return how many of the views have depth, after a comma; '' if none has."""
    deep = sum(view.depth is not None for view in views)
    return f', {deep} with depth' if deep else ''


def _print_run(run: 'RecordedRun', replays: bool) -> None:
    from active_recon.bags.runs.missing import describe_missing
    from active_recon.geometry.cameras import whole_degrees
    from active_recon.report.words import counted

    chosen = 'that its view gate accepts' if 'bag' in run.counters else 'that the loop took'
    typer.echo(f'{"can be replayed, with " if replays else ""}the views {chosen}:')
    for number, episode in enumerate(run.episodes, 1):
        azimuths = ', '.join(str(whole_degrees(view.camera.azimuth)) for view in episode.views)
        end = f', done: {episode.done}' if episode.done else ''
        at = 'azimuth' if len(episode.views) == 1 else 'azimuths'
        taken = (f'{counted(len(episode.views), "view")} at {at} {azimuths} degrees'
                 f'{told_depth(episode.views)}'
                 f'{", after others without an image" if episode.begun_before else ""}')
        typer.echo(f'  episode {number}: {taken if azimuths else "no view"}{end}')
        if missing := describe_missing(episode):
            typer.echo(f'    not recorded, so not compared: {", ".join(missing)}')
    print_refusals(run)
    if run.assumed and (not replays or 'bag' in run.counters):
        typer.echo('assumed, since the bag does not say:')
        for assumption in run.assumed:
            typer.echo(f'  {assumption}')
