"""`active-recon replay`: a recorded run again, with no ROS running, as it was or under others."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
import math
from pathlib import Path
import time
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_options import with_bag_options
from active_recon.cli.policy_option import policy_option
from active_recon.cli.progress import bag_progress, progress_bar
from active_recon.cli.shape_files import ShapeFiles
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.replay.verification import Verification
    from active_recon.bags.replay.what_if import Others
    from active_recon.bags.runs.run import RecordedRun
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.settings import Settings
    from active_recon.bags.runs.topics import Topics
    from active_recon.reconstructor import Reconstructor


@with_bag_options
def replay(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help='A rosbag2 folder, or an MCAP or sqlite3 file.')],
    topics: 'Topics',
    scene: 'Scene',
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
    mesh: Annotated[Path | None, typer.Option(
        help='Write the shape after the last view as PLY, OBJ or STL, metres; of several episodes '
             'each, with its number.')] = None,
    voxels: Annotated[Path | None, typer.Option(
        help='The same as voxels: binvox, or npz with their probabilities.')] = None,
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

    Example: active-recon replay drive.db3 --object-size 0.16 --mesh mug.ply
    """
    from active_recon.bags.replay.comparison import NOTHING_RECORDED
    from active_recon.bags.replay.verification import verify
    from active_recon.bags.replay.what_if import Others
    from active_recon.bags.runs.reading import read_run
    from active_recon.bags.runs.settings import recorded_settings
    from active_recon.models.weights_files import find_weights

    others = Others(find_weights(model) if model else None, policy, threshold)
    if out and others == Others():
        raise ConfigError('--out without --model, --policy or --threshold: no bag is written '
                          'where nothing is other')
    files = ShapeFiles(mesh, voxels)
    began = time.monotonic()
    run = read_run(path, topics, scene, bag_progress(path))
    reading_s = time.monotonic() - began
    settings = recorded_settings(run, others.weights or weights, others.weights is not None,
                                 scene.given)
    settings = replace(settings, threads=threads or settings.threads)
    if others != Others():
        _write_under(run, settings, others, out, files)
        return
    reconstructor, planner = settings.load_reconstructor(), settings.load_planner()
    began = time.monotonic()
    with _bar('replaying', run) as advance:
        verified = verify(run, reconstructor, planner, lambda: advance(1, ''))
    took_s = reading_s + time.monotonic() - began
    files.write([episode.views[-1].reconstruction.grid for episode in verified.episodes
                 if episode.views], reconstructor.threshold)
    if verified.comparison.verdict == NOTHING_RECORDED:
        _tell_reconstructed(verified, run, reconstructor)
    else:
        _tell(verified, run, took_s)


def _tell_reconstructed(verified: 'Verification', run: 'RecordedRun',
                        reconstructor: 'Reconstructor') -> None:
    """Say what came of a bag that has no record of the loop's to compare with."""
    for assumption in run.assumed:
        typer.echo(f'assumed: {assumption}')
    for episode in verified.episodes:
        if not episode.views:
            continue
        first, last = (view.reconstruction.grid for view in (episode.views[0], episode.views[-1]))
        count = int(last.occupied(reconstructor.threshold).sum())
        typer.echo(
            f'reconstructed from {len(episode.views)} views: {count} of {last.occupancy.size} '
            f'cells above {reconstructor.threshold:.2f}, entropy {first.entropy():.0f} to '
            f'{last.entropy():.0f} nats; the bag has no record to compare with')
    typer.echo(f'hash {verified.hash}')


def _tell(verified: 'Verification', run: 'RecordedRun', took_s: float) -> None:
    from active_recon.bags.replay.comparison import DIFFERENT

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
    typer.echo(f'{verdict}: what was recorded and the replay')
    if verdict == DIFFERENT:
        raise typer.Exit(1)


def _write_under(run: 'RecordedRun', settings: 'Settings', others: 'Others',
                 out: Path | None, files: ShapeFiles) -> None:
    from active_recon.bags.replay.what_if import beside, run_under
    from active_recon.bags.runs.run_writing import write_run

    with _bar('replaying', run) as advance:
        other = run_under(run, settings, others, lambda: advance(1, ''))
    folder = out or beside(run.path, others)
    write_run(other, folder)
    grids = [episode.views[-1].reconstruction for episode in other.episodes if episode.views]
    threshold = settings.under(others.weights, threshold=others.threshold
                               ).load_reconstructor().threshold
    files.write([grid for grid in grids if grid is not None], threshold)
    for episode in other.episodes:
        entropies = ', '.join(f'{view.entropy:.0f}' for view in episode.views)
        azimuths = ', '.join(
            f'{math.degrees(view.camera.azimuth):.0f}' for view in episode.views)
        typer.echo(f'views from {azimuths} degrees; entropy {entropies} nats')
    typer.echo(f'wrote {folder}')


def _bar(title: str, run: 'RecordedRun') -> AbstractContextManager[Callable[[int, str], None]]:
    return progress_bar(title, sum(len(episode.views) for episode in run.episodes))
