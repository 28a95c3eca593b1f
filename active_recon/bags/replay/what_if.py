"""A recorded run under another model, another threshold or another policy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path

from active_recon import __version__
from active_recon.acquisition.view_gate import GOAL_TOLERANCE
from active_recon.bags.replay.replay import decide
from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.recorded_object import RecordedObject, seen_again
from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedRun, RecordedView
from active_recon.bags.runs.settings import Settings
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, nearest_camera, view_distance
from active_recon.planner import Decision, Planner
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.voxels import PUBLISHED_FLOOR
import numpy as np

_BETWEEN_VIEWS = 1_000_000_000  # nanoseconds: views in another order need stamps of their own


@dataclass(frozen=True)
class Others:
    """What a run is to be replayed under; None: as it was."""

    weights: Path | None = None
    policy: str | None = None
    threshold: float | None = None

    @property
    def name(self) -> str:
        """What is other, in a word for the name of a bag."""
        return '_'.join(word for word in (
            self.weights and self.weights.stem, self.policy,
            self.threshold and f'threshold-{self.threshold:g}') if word)


def beside(path: Path, others: Others) -> Path:
    """Return where a bag's replay under others goes: beside it, with what is other in its name."""
    place = path.resolve()
    name = place.name if place.is_dir() else place.stem
    return place.with_name(f'{name}_{others.name}')


def run_under(run: RecordedRun, recorded: Settings, others: Others,
              advance: Callable[[], None] = lambda: None) -> RecordedRun:
    """
    Return the run as it would have been under others, for a bag of its own.

    Another policy chooses among the recorded views, and they get new stamps. Otherwise views and
    goals stay what they were; with another model the run then tells no longer which policy chose
    them. Raises DataError where the policy wants a view that was never taken, and WeightsError or
    ConfigError where the others cannot be had.
    """
    settings = recorded.under(others.weights, others.policy, others.threshold)
    reconstructor = settings.load_reconstructor()
    before = sorted(run.episodes, key=lambda episode: episode.begin)
    if others.policy is None:
        episodes = [reconstructed(episode, reconstructor, advance) for episode in before]
    else:
        planner = settings.load_planner()
        assert planner is not None
        tolerance = node_parameters(run, 'reconstructor').get('goal_tolerance', GOAL_TOLERANCE)
        episodes = [explored(episode, reconstructor, planner, tolerance, advance)
                    for episode in before]
    made_by = dict(reconstructor.provenance)
    provenance = {**run.provenance, **made_by, 'version': __version__,
                  'replay_of': run.path.resolve().name}
    parameters = {'/reconstructor': {
        **node_parameters(run, 'reconstructor'), **made_by, 'threshold': math.nan,
        'weights': str(settings.weights), **settings.reconstructor}}
    if settings.planner is not None and (others.policy or not others.weights):
        planning = {**node_parameters(run, 'view_planner'), **settings.planner,
                    'weights': str(settings.planner['weights'])}
        parameters['/view_planner'] = planning
        provenance['policy'] = planning['policy']
    times = [time for episode in episodes for view in episode.views
             for time in (view.stamp, *view.received.values())]
    return replace(run, episodes=episodes, provenance=provenance, parameters=parameters,
                   begin=min(times, default=run.begin), end=max(times, default=run.end))


def reconstructed(episode: RecordedEpisode, reconstructor: Reconstructor,
                  advance: Callable[[], None] = lambda: None) -> RecordedEpisode:
    """Return the episode with the same views and goals, reconstructed by another model."""
    views = []
    for step in seen_again(episode.views, reconstructor):
        views.append(_known(step.view, step.known, reconstructor.threshold))
        advance()
    return replace(episode, views=views)


def explored(episode: RecordedEpisode, reconstructor: Reconstructor, planner: Planner,
             goal_tolerance: float, advance: Callable[[], None] = lambda: None) -> RecordedEpisode:
    """
    Return the episode as it would have been had the planner chosen among the recorded views.

    The first view is the one that the run began with. A goal is reached by the nearest view
    within `goal_tolerance`, radians. The views get stamps of their own, a second apart. Raises
    DataError that names the azimuth where no view was taken near a goal.
    """
    if not episode.views:
        raise DataError('no view in the episode, and so none to choose from',
                        'no_views')
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
        stamp = episode.begin + step.number * _BETWEEN_VIEWS
        decision = decide(planner, step.known, step.view.camera)
        known = _known(step.view, step.known, reconstructor.threshold)
        views.append(replace(
            known, stamp=stamp, received={}, done=decision.reason,
            # A nanosecond later: the goal comes after the view that led to it
            goal=None if decision.goal is None else RecordedGoal.of(decision.goal, stamp + 1)))
        advance()
    return replace(episode, first_goal=RecordedGoal.of(first, episode.begin), views=views,
                   done=decision.reason)


def _nearest(views: Sequence[RecordedView], goal: Camera, tolerance: float,
             taken: int) -> RecordedView:
    view = views[nearest_camera(goal, [view.camera for view in views])]
    away = view_distance(view.camera, goal)
    if away > tolerance:
        raise DataError(
            f'after view {taken} the policy asks for a view from an azimuth of '
            f'{np.degrees(goal.azimuth):.1f} degrees and an elevation of '
            f'{np.degrees(goal.elevation):.1f}; expected one within '
            f'{np.degrees(tolerance):.1f} degrees of it among the {len(views)} recorded, the '
            f'nearest is {np.degrees(away):.1f} off. A view that was never taken is not '
            'made up: record all azimuths by `active-recon record-sweep`', 'missing_view')
    return view


def _known(view: RecordedView, reconstruction: Reconstruction, threshold: float) -> RecordedView:
    """Return the view with what the reconstructor would have published of it."""
    grid = reconstruction.grid
    return replace(
        view, reconstruction=grid.above(PUBLISHED_FLOOR), occupied=grid.above(threshold),
        latent=reconstruction.latent, entropy=grid.entropy())
