"""`active-recon replay`: replays a recorded run without ROS, as recorded or with overrides."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
import time
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_info import print_refusals, told_depth
from active_recon.cli.bag_options import with_bag_options
from active_recon.cli.number_lists import box_numbers
from active_recon.cli.policy_option import policy_option
from active_recon.cli.progress import bag_progress, progress_bar
from active_recon.cli.shape_files import ShapeFiles
from active_recon.errors import ConfigError
from active_recon.runtimes import PRECISIONS, REMARK, RUNTIME_CHOICES
import typer

if TYPE_CHECKING:
    from active_recon.bags.replay.replay import ReplayedEpisode
    from active_recon.bags.replay.verification import Verification
    from active_recon.bags.runs.loop_setup import LoopSetup, Overrides
    from active_recon.bags.runs.run import RecordedRun
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics
    from active_recon.quality.quality import Quality
    from active_recon.reconstructor import Reconstructor


@with_bag_options
def replay(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help='A rosbag2 folder, or an MCAP or sqlite3 file.')],
    topics: 'Topics',
    scene: 'Scene',
    model: Annotated[str | None, typer.Option(
        help='Replay with another model: its name, or a weights file. The views stay as recorded.',
    )] = None,
    policy: Annotated[str | None, policy_option(
        'Replay with another policy. It can only choose views that are in the bag; any other '
        'is an error.')] = None,
    threshold: Annotated[float | None, typer.Option(
        help='Replay with another occupancy threshold.')] = None,
    box: Annotated[str | None, typer.Option(
        metavar='X,Y,Z,SIDE',
        help='Replay in another cube: its centre in the object frame and its side, metres, such '
             'as the one that is told to fit. In the new bag the object frame has its origin at '
             'that centre; shapes that are written have it there, too.')] = None,
    out: Annotated[Path | None, typer.Option(
        help='Folder of the new bag, with --model, --policy, --threshold or --box; default: next '
             'to BAG, with these options in its name.')] = None,
    weights: Annotated[Path | None, typer.Option(
        help='The weights file that BAG was recorded with, if those weights do not ship.',
    )] = None,
    mesh: Annotated[Path | None, typer.Option(
        help='Write the mesh after the last view, with the colours of the views, to a PLY, OBJ, '
             'STL or GLB file, in metres, or as a robot description to a URDF file; several '
             'episodes get numbered files.')] = None,
    density: Annotated[float | None, typer.Option(
        help='Density of the object in kg/m^3, for --mesh NAME.urdf; default: 500.')] = None,
    voxels: Annotated[Path | None, typer.Option(
        help='Write the voxels after the last view to a binvox file, or to an npz file with '
             'probabilities; several episodes get numbered files.')] = None,
    threads: Annotated[int | None, typer.Option(
        min=1, help='CPU threads of the network; default: as recorded.')] = None,
    runtime: Annotated[str | None, typer.Option(
        help=f'Runtime of the network: {", ".join(RUNTIME_CHOICES)}; default: as '
             'recorded.')] = None,
    precision: Annotated[str | None, typer.Option(
        help=f'Its numbers: {", ".join(PRECISIONS)}; default: as recorded.')] = None,
) -> None:
    """
    Replay a bag and compare it with the recording, or with another model, policy or cube.

    Network and policy process the images again in the order of their stamps, without ROS and
    without a clock. With the same machine and versions the results are bit-identical; on another
    machine they agree within a tolerance. The output says which; if they differ, the exit code is
    1. With --model, --policy, --threshold or --box nothing is compared, and a new bag is written.

    Example: active-recon replay bags/2026-11-21_14-35-54

    Example: active-recon replay bags/sweep --policy farthest

    Example: active-recon replay bags/sweep --box 0,0,-0.03,0.12 --mesh mug.ply

    Example: active-recon replay drive.db3 --object-size 0.16 --mesh mug.ply
    """
    from active_recon.bags.replay.comparison import NOTHING_RECORDED
    from active_recon.bags.replay.verification import verify
    from active_recon.bags.runs.loop_setup import Overrides, recorded_setup
    from active_recon.bags.runs.reading import read_run
    from active_recon.models.weights_files import find_weights

    overrides = Overrides(find_weights(model) if model else None, policy, threshold,
                          None if box is None else box_numbers(box))
    if out and overrides == Overrides():
        raise ConfigError('--out: no bag to write: expected it with --model, --policy, '
                          '--threshold or --box, got none of them')
    if model and weights:
        raise ConfigError('--weights beside --model: expected one of them, the weights of the '
                          'recording or another model, got both')
    files = ShapeFiles(mesh, voxels, density)
    began = time.monotonic()
    run = read_run(path, topics, scene, bag_progress(path))
    reading_s = time.monotonic() - began
    setup = recorded_setup(run, overrides.weights or weights, overrides.weights is not None,
                           scene.parameters)
    setup = replace(setup, threads=threads or setup.threads, runtime=runtime or setup.runtime,
                    precision=precision or setup.precision)
    if overrides != Overrides():
        _write_with_overrides(run, setup, overrides, out, files)
        return
    reconstructor, planner = setup.load_reconstructor(), setup.load_planner()
    _warn_of_runtime(reconstructor.provenance, {} if planner is None else planner.provenance)
    began = time.monotonic()
    with _bar('replaying', run) as advance:
        verified = verify(run, reconstructor, planner, lambda: advance(1, ''))
    took_s = reading_s + time.monotonic() - began
    files.write([(episode.steps[-1].reconstruction.grid,
                  [step.recorded for step in episode.steps])
                 for episode in verified.episodes if episode.steps], reconstructor.threshold)
    if verified.comparison.verdict == NOTHING_RECORDED:
        _print_reconstruction(verified, run, reconstructor)
    else:
        _print_comparison(verified, run, reconstructor.threshold, took_s)


def _warn_of_runtime(*provenances: Mapping[str, str]) -> None:
    """Warn, once, where networks were not run by what was preferred."""
    for remark in dict.fromkeys(told[REMARK] for told in provenances if REMARK in told):
        typer.echo(f'warning: {remark}', err=True)


def _print_reconstruction(verified: 'Verification', run: 'RecordedRun',
                          reconstructor: 'Reconstructor') -> None:
    """Print the result for a bag that has no record of the loop to compare with."""
    _print_input(run)
    for episode in verified.episodes:
        if not episode.steps:
            continue
        first, last = (step.reconstruction.grid for step in (episode.steps[0], episode.steps[-1]))
        count = int(last.occupied(reconstructor.threshold).sum())
        uncompared = ('not compared, since views before them have no image in the bag'
                      if episode.recorded.begun_before else
                      'the bag has no record to compare with')
        typer.echo(
            f'reconstructed from {len(episode.steps)} views'
            f'{told_depth([step.recorded for step in episode.steps])}: '
            f'{count} of {last.occupancy.size} '
            f'cells above {reconstructor.threshold:.2f}, entropy {first.entropy():z.0f} to '
            f'{last.entropy():z.0f} nats; {uncompared}')
        _print_quality(episode, reconstructor.threshold)
        _print_refused_depth([step.reconstruction.depth_refusal for step in episode.steps])
    typer.echo(f'hash {verified.hash}')


def _print_input(run: 'RecordedRun') -> None:
    """Print what was assumed, and what was left out, of a bag without a record of the loop."""
    for assumption in run.assumed:
        typer.echo(f'assumed: {assumption}')
    print_refusals(run)


def _print_refused_depth(refusals: Sequence[str]) -> None:
    """Print how many of an episode's views went without their depth; '' is none refused."""
    refused = [refusal for refusal in refusals if refusal]
    if refused:
        typer.echo(f'depth of {len(refused)} of them was left out: {refused[0]}')


def _print_quality(episode: 'ReplayedEpisode', threshold: float) -> None:
    """Print how good the shape is after an episode's last view, and a cube that fits better."""
    from active_recon.volumes.better_cube import better_cube

    if not episode.steps:
        return
    known = episode.steps[-1].reconstruction
    _print_judged(known.quality)
    better = better_cube(known.grid, threshold, len(episode.steps))
    if better is not None:
        typer.echo(better.warning_of_bag)


def _print_judged(quality: 'Quality | None') -> None:
    if quality is not None:
        warning = f'; {quality.warning}' if quality.warning else ''
        typer.echo(f'quality: {quality.summary}{warning}')


def _print_comparison(verified: 'Verification', run: 'RecordedRun', threshold: float,
                      took_s: float) -> None:
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
            typer.echo(f'episode {number} had views of which the bag has no image, from before '
                       'the camera or the episode was recorded: it is not compared')
    for replayed in verified.episodes:
        _print_quality(replayed, threshold)
    if not verified.knows_policy:
        typer.echo('the bag does not name its policy: goals and stop are not compared')
    if 'weights_sha256' not in run.provenance:
        typer.echo('the bag does not name its network: that of the options, else the default, '
                   'was compared (--weights, --precision)')
    verdict = verified.comparison.verdict
    for assumption in run.assumed if verdict == DIFFERENT else ():
        typer.echo(f'assumed: {assumption}')
    typer.echo(f'hash {verified.hash}')
    typer.echo(f'{verdict}: recording and replay')
    if verdict == DIFFERENT:
        raise typer.Exit(1)


def _write_with_overrides(run: 'RecordedRun', setup: 'LoopSetup', overrides: 'Overrides',
                          out: Path | None, files: ShapeFiles) -> None:
    from active_recon.bags.replay.what_if import default_folder, run_with_overrides
    from active_recon.bags.runs.run_writing import write_run
    from active_recon.geometry.cameras import whole_degrees

    with _bar('replaying', run) as advance:
        other = run_with_overrides(run, setup, overrides, lambda: advance(1, ''))
    _warn_of_runtime(other.provenance)
    folder = out or default_folder(run.path, overrides)
    write_run(other, folder)
    shapes = [(episode.views[-1].reconstruction, episode.views)
              for episode in other.episodes if episode.views]
    threshold = setup.with_overrides(overrides).load_reconstructor().threshold
    files.write([(grid, views) for grid, views in shapes if grid is not None], threshold)
    _print_input(run)
    for episode in other.episodes:
        entropies = ', '.join(f'{view.entropy:z.0f}' for view in episode.views)
        azimuths = ', '.join(str(whole_degrees(view.camera.azimuth)) for view in episode.views)
        typer.echo(f'views from {azimuths} degrees; entropy {entropies} nats')
        if episode.views:
            _print_judged(episode.views[-1].quality)
        _print_refused_depth([view.depth_refusal for view in episode.views])
    typer.echo(f'wrote {folder}')


def _bar(title: str, run: 'RecordedRun') -> AbstractContextManager[Callable[[int, str], None]]:
    return progress_bar(title, sum(len(episode.views) for episode in run.episodes))
