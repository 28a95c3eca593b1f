"""`active-recon replay`: a recorded run again, with no ROS running, as it was or under others."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
import math
from pathlib import Path
import time
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_topics import with_topics
from active_recon.cli.policy_option import policy_option
from active_recon.cli.progress import bag_progress, progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.run import RecordedRun
    from active_recon.bags.settings import Settings
    from active_recon.bags.topics import Topics
    from active_recon.bags.under_others import Others
    from active_recon.bags.verification import Verification


@with_topics
def replay(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help='A rosbag2 folder, or an MCAP or sqlite3 file.')],
    topics: 'Topics',
    model: Annotated[str | None, typer.Option(
        help='Another model: its name, or a weights file. The views stay those that were taken.',
    )] = None,
    policy: Annotated[str | None, policy_option(
        'Another policy. It chooses among the views of the bag, and is refused where it wants '
        'one that was never taken.')] = None,
    threshold: Annotated[float | None, typer.Option(
        help='Another occupancy above which a cell is occupied.')] = None,
    out: Annotated[Path | None, typer.Option(
        help='The folder of the new bag, with one of the three above; default: beside BAG, with '
             'what is other in its name.')] = None,
    weights: Annotated[Path | None, typer.Option(
        help='The weights file that BAG was recorded with, where it does not ship any more.',
    )] = None,
    object_size: Annotated[float | None, typer.Option(
        min=0.001, max=1000.0, help='Side of the voxel grid, m; default: as recorded, else 1.',
    )] = None,
    object_yaw_deg: Annotated[float | None, typer.Option(
        min=-360.0, max=360.0,
        help="Azimuth of the object's front; default: as recorded, else 0.")] = None,
    threads: Annotated[int | None, typer.Option(
        min=1, help='CPU threads of the network; default: as many as the run had.')] = None,
) -> None:
    """
    Replay a bag and compare with what was recorded, or replay it under others.

    The images go through the network and the policy again, in the order of their stamps, with no
    ROS running and no clock. The same machine and versions give the same bits, another machine the
    same within a tolerance; which of them held is told. Exit code 1: neither. With --model,
    --policy or --threshold nothing is compared, and a new bag is written beside the old one.

    Example: active-recon replay bags/2026-11-21_14-35-54

    Example: active-recon replay bags/sweep --policy farthest
    """
    from active_recon.bags.reading import read_run
    from active_recon.bags.settings import recorded_settings
    from active_recon.bags.under_others import Others
    from active_recon.bags.verification import verify
    from active_recon.weights_files import find_weights

    others = Others(find_weights(model) if model else None, policy, threshold)
    if out and others == Others():
        raise ConfigError('--out: expected with --model, --policy or --threshold, for a new bag; '
                          'without them nothing is written')
    began = time.monotonic()
    run = read_run(path, topics, bag_progress(path))
    reading_s = time.monotonic() - began
    settings = recorded_settings(
        run, others.weights or weights, others.weights is not None, {
            'object_size': object_size,
            'object_yaw': None if object_yaw_deg is None else math.radians(object_yaw_deg)})
    settings = replace(settings, threads=threads or settings.threads)
    if others != Others():
        _write_under(run, settings, others, out)
        return
    reconstructor, planner = settings.load_reconstructor(), settings.load_planner()
    began = time.monotonic()
    with _bar('replaying', run) as advance:
        verified = verify(run, reconstructor, planner, lambda: advance(1, ''))
    _tell(verified, run, reading_s + time.monotonic() - began)


def _tell(verified: 'Verification', run: 'RecordedRun', took_s: float) -> None:
    from active_recon.bags.comparison import DIFFERENT, NOTHING_RECORDED

    ran_s = (run.end - run.begin) / 1e9
    typer.echo(f'views: {verified.view_count}, read and replayed in {took_s:.2f} s, '
               f'{ran_s / took_s:.0f} times as fast as they were recorded ({ran_s:.1f} s)')
    for name, found in verified.comparison.deviations.items():
        gap = '' if found.same == found.compared else (
            f'{found.same} of {found.compared} the same, at most {found.largest:.2g} apart '
            f'(tolerance {found.tolerance:g})')
        typer.echo(f'  {name:<14}{found.compared:>4} compared  {found.verdict:<17} {gap}'.rstrip())
    for number, episode in enumerate(run.episodes, 1):
        if episode.begun_before:
            typer.echo(f'episode {number} had begun before the recording: it is not compared')
    if not verified.knows_policy:
        typer.echo('the bag does not tell which policy chose: goals and stop are not compared')
    typer.echo(f'hash {verified.hash}')
    verdict = verified.comparison.verdict
    typer.echo({NOTHING_RECORDED: 'nothing was recorded that could be compared'}.get(
        verdict, f'{verdict}: what was recorded and the replay'))
    if verdict == DIFFERENT:
        raise typer.Exit(1)


def _write_under(run: 'RecordedRun', settings: 'Settings', others: 'Others',
                 out: Path | None) -> None:
    from active_recon.bags.run_writing import write_run
    from active_recon.bags.under_others import beside, run_under

    with _bar('replaying', run) as advance:
        other = run_under(run, settings, others, lambda: advance(1, ''))
    folder = out or beside(run.path, others)
    write_run(other, folder)
    for episode in other.episodes:
        entropies = ', '.join(f'{view.entropy:.0f}' for view in episode.views)
        azimuths = ', '.join(
            f'{math.degrees(view.camera.azimuth):.0f}' for view in episode.views)
        typer.echo(f'views from {azimuths} degrees; entropy {entropies} nats')
    typer.echo(f'wrote {folder}')


def _bar(title: str, run: 'RecordedRun') -> AbstractContextManager[Callable[[int, str], None]]:
    return progress_bar(title, sum(len(episode.views) for episode in run.episodes))
