"""A recorded run under another model, another threshold or another policy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path

from active_recon import __version__
from active_recon.bags.parameters import node_parameters
from active_recon.bags.replay import decide
from active_recon.bags.run import RecordedEpisode, RecordedGoal, RecordedRun, RecordedView
from active_recon.bags.settings import Settings
from active_recon.cameras import azimuth_difference, wrap_azimuth
from active_recon.errors import DataError
from active_recon.planner import Goal, Planner
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.view_gate import GOAL_TOLERANCE
from active_recon.voxels import PUBLISHED_FLOOR
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
    made_by = {'weights_sha256': reconstructor.weights_hash,
               'config_sha256': reconstructor.config_hash}
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
    reconstructor.reset()
    views = []
    for view in sorted(episode.views, key=lambda view: view.stamp):
        views.append(_known(view, reconstructor.add_view(view.image, view.camera),
                            reconstructor.threshold))
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
        raise DataError('expected an episode with views to choose from, got one without',
                        'no_views')
    reconstructor.reset()
    planner.reset()
    began = (min(episode.views, key=lambda view: view.stamp).camera.azimuth
             if episode.first_goal is None else episode.first_goal.azimuth)
    first = planner.first_goal(began)
    goal: Goal | None = first
    views: list[RecordedView] = []
    while goal is not None:
        view = _nearest(episode.views, goal.azimuth, goal_tolerance, len(views))
        stamp = episode.begin + (len(views) + 1) * _BETWEEN_VIEWS
        reconstruction = reconstructor.add_view(view.image, view.camera)
        decision = decide(planner, reconstruction, view.camera.azimuth)
        goal = decision.goal
        known = _known(view, reconstruction, reconstructor.threshold)
        views.append(replace(
            known, stamp=stamp, received={}, done=decision.reason,
            # A nanosecond later: the goal comes after the view that led to it
            goal=None if goal is None else _recorded(goal, stamp + 1)))
        advance()
    return replace(episode, first_goal=_recorded(first, episode.begin), views=views,
                   done=decision.reason)


def _nearest(views: Sequence[RecordedView], azimuth: float, tolerance: float,
             taken: int) -> RecordedView:
    away = np.abs(azimuth_difference([view.camera.azimuth for view in views], azimuth))
    nearest = int(away.argmin())
    if away[nearest] > tolerance:
        raise DataError(
            f'after view {taken} the policy asks for a view from an azimuth of '
            f'{np.degrees(wrap_azimuth(azimuth)):.1f} degrees; expected one within '
            f'{np.degrees(tolerance):.1f} degrees of it among the {len(views)} recorded, the '
            f'nearest is {np.degrees(away[nearest]):.1f} off. A view that was never taken is not '
            'made up: record all azimuths by `active-recon record-sweep`', 'missing_view')
    return views[nearest]


def _known(view: RecordedView, reconstruction: Reconstruction, threshold: float) -> RecordedView:
    """Return the view with what the reconstructor would have published of it."""
    grid = reconstruction.grid
    return replace(
        view, reconstruction=grid.above(PUBLISHED_FLOOR), occupied=grid.above(threshold),
        latent=reconstruction.latent, entropy=grid.entropy())


def _recorded(goal: Goal, stamp: int) -> RecordedGoal:
    return RecordedGoal(wrap_azimuth(goal.azimuth), stamp, goal.candidates, goal.scores, stamp)
