"""A recorded run as it would have been with another model, threshold, policy or cube."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from active_recon import __version__
from active_recon.acquisition.view_gate import GOAL_TOLERANCE
from active_recon.bags.replay.other_cube import about
from active_recon.bags.replay.replay import decide
from active_recon.bags.runs.loop_record import LOOP
from active_recon.bags.runs.loop_setup import LoopSetup, Overrides
from active_recon.bags.runs.parameters import node_parameters, nodes_called
from active_recon.bags.runs.recorded_object import RecordedObject, replay_views
from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedRun, RecordedView
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, OBJECT_FRAME
from active_recon.geometry.view_distance import nearest_camera, view_distance
from active_recon.planner import Decision, Planner
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.voxels import PUBLISHED_FLOOR
import numpy as np

_VIEW_PERIOD_NS = 1_000_000_000  # views in a new order get stamps of their own


def default_folder(path: Path, overrides: Overrides) -> Path:
    """Return the folder for the new bag: next to the old one, with the overrides in its name."""
    place = path.resolve()
    name = place.name if place.is_dir() else place.stem
    return place.with_name(f'{name}_{overrides.name}')


def run_with_overrides(run: RecordedRun, recorded: LoopSetup, overrides: Overrides,
                       advance: Callable[[], None] = lambda: None) -> RecordedRun:
    """
    Return the run as it would have been with the overrides, to be written as a bag.

    Another policy chooses among the recorded views, which get new stamps. Otherwise views and
    goals stay as recorded; with another model or cube the run no longer states the policy that
    chose them. With another cube the object frame has its origin at the cube's centre, and the
    run no longer states what a simulated turntable showed, which is placed in the recorded cube.
    Raises DataError if the policy asks for a view that was never taken, WeightsError or
    ConfigError if an override is invalid.
    """
    setup = recorded.with_overrides(overrides)
    reconstructor = setup.load_reconstructor()
    # The new bag has the whole images: a replay of it has no reduced ones
    before = [replace(episode, views=[replace(view, reduced=None) for view in episode.views])
              for episode in sorted(run.episodes, key=lambda episode: episode.begin)]
    if overrides.box is not None:
        before = [about(episode, overrides.box[:3]) for episode in before]
    if overrides.policy is None:
        episodes = [reconstruct_episode(episode, reconstructor, advance) for episode in before]
    else:
        planner = setup.load_planner()
        assert planner is not None
        tolerance = node_parameters(run, 'reconstructor').get('goal_tolerance', GOAL_TOLERANCE)
        episodes = _replanned(before, reconstructor, planner, tolerance, advance)
    made_by = dict(reconstructor.provenance)
    # The new bag has the topics under their own names
    kept = {name: text for name, text in run.provenance.items()
            if not (text.startswith('/') and ('/' in name or name in LOOP))}
    provenance = {**kept, **made_by, 'version': __version__,
                  'replay_of': run.path.resolve().name}
    parameters: dict[str, Mapping[str, Any]] = {'/reconstructor': {
        **node_parameters(run, 'reconstructor'), **_with_depth(episodes), **made_by,
        'threshold': math.nan, 'weights': str(setup.weights), 'runtime': setup.runtime,
        'precision': setup.precision, **setup.reconstructor,
        **({'object_frame': OBJECT_FRAME} if overrides.box else {})}}
    if setup.planner is not None and (
            overrides.policy or not (overrides.weights or overrides.box)):
        planning = {**node_parameters(run, 'view_planner'), **setup.planner,
                    'policy_in_use': setup.planner['policy'],
                    'weights': str(setup.planner['weights'])}
        parameters['/view_planner'] = planning
        provenance['policy'] = planning['policy']
    if overrides.box is None:
        parameters.update(nodes_called('turntable_camera', run.parameters))
    times = [time for episode in episodes for view in episode.views
             for time in (view.stamp, *view.received.values())]
    return replace(run, episodes=episodes, provenance=provenance, parameters=parameters,
                   begin=min(times, default=run.begin), end=max(times, default=run.end))


def _with_depth(episodes: Sequence[RecordedEpisode]) -> dict[str, bool]:
    """Return the parameter without which the depth of the views would not be read again."""
    deep = any(view.depth is not None for episode in episodes for view in episode.views)
    return {'use_depth': True} if deep else {}


def _replanned(before: Sequence[RecordedEpisode], reconstructor: Reconstructor, planner: Planner,
               goal_tolerance: float, advance: Callable[[], None]) -> list[RecordedEpisode]:
    """Replan every episode that has views; each begins after the last view of the one before."""
    if not any(episode.views for episode in before):
        raise DataError('no views in the bag to choose from', 'no_views')
    episodes, free = [], 0
    for recorded in before:
        episode = replace(recorded, begin=max(recorded.begin, free))
        if episode.views:
            episode = replan_episode(episode, reconstructor, planner, goal_tolerance, advance)
            free = episode.views[-1].stamp + _VIEW_PERIOD_NS
        else:
            episode = replace(episode, first_goal=None)
        episodes.append(episode)
    return episodes


def reconstruct_episode(episode: RecordedEpisode, reconstructor: Reconstructor,
                        advance: Callable[[], None] = lambda: None) -> RecordedEpisode:
    """Return the episode with the same views and goals, reconstructed by another model."""
    views = []
    for step in replay_views(episode.views, reconstructor):
        views.append(_reconstructed(step.view, step.known, reconstructor.threshold))
        advance()
    return replace(episode, views=views)


def replan_episode(episode: RecordedEpisode, reconstructor: Reconstructor, planner: Planner,
                   goal_tolerance: float, advance: Callable[[], None] = lambda: None
                   ) -> RecordedEpisode:
    """
    Return the episode as if the planner had chosen among its recorded views.

    It starts with the first recorded view. A goal is reached by the nearest view within
    `goal_tolerance`, radians. The views get new stamps, a second apart. Raises DataError with the
    azimuth of a goal near which no view was taken.
    """
    if not episode.views:
        raise DataError('no views in the episode to choose from', 'no_views')
    planner.reset()
    began = (min(episode.views, key=lambda view: view.stamp).camera
             if episode.first_goal is None else episode.first_goal.camera)
    first = planner.first_goal(began)
    decision = Decision(first)

    def follow(step: TimeStep[RecordedView, Reconstruction]) -> RecordedView | None:
        if decision.goal is None:
            return None
        return _nearest(episode.views, decision.goal.camera, goal_tolerance, step.number)

    views = []
    for step in run_episode(RecordedObject(reconstructor),
                            _nearest(episode.views, first.camera, goal_tolerance, 0), follow):
        stamp = episode.begin + step.number * _VIEW_PERIOD_NS
        decision = decide(planner, step.known, step.view.camera, step.known.quality)
        view = _reconstructed(step.view, step.known, reconstructor.threshold)
        views.append(replace(
            view, stamp=stamp, received={}, done=decision.reason,
            # A nanosecond later: the goal comes after the view that led to it
            goal=None if decision.goal is None else RecordedGoal.of(
                decision.goal, stamp + 1, reason=planner.reason())))
        advance()
    return replace(episode, first_goal=RecordedGoal.of(first, episode.begin), views=views,
                   done=decision.reason)


def _nearest(views: Sequence[RecordedView], goal: Camera, tolerance: float,
             taken: int) -> RecordedView:
    view = views[nearest_camera(goal, [view.camera for view in views])]
    away = view_distance(view.camera, goal)
    if away > tolerance:
        advice = '' if abs(goal.elevation - view.camera.elevation) > tolerance else (
            '. Record all azimuths by `active-recon record-sweep`')
        raise DataError(
            f'no recorded view at the goal after view {taken}, azimuth '
            f'{np.degrees(goal.azimuth):.1f} degrees, elevation {np.degrees(goal.elevation):.1f}: '
            f'expected one within {np.degrees(tolerance):.1f} degrees among {len(views)}, the '
            f'nearest is {np.degrees(away):.1f} off{advice}', 'missing_view')
    return view


def _reconstructed(view: RecordedView, reconstruction: Reconstruction,
                   threshold: float) -> RecordedView:
    """Return the view with what the reconstructor would have published after it."""
    grid = reconstruction.grid
    return replace(
        view, reconstruction=grid.above(PUBLISHED_FLOOR), occupied=grid.above(threshold),
        latent=reconstruction.latent, entropy=grid.entropy(), quality=reconstruction.quality,
        depth_refusal=reconstruction.depth_refusal)
