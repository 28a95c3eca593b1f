"""A recorded run on the page: step through its views, or play them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from active_recon.bags.runs.run import (
    RecordedEpisode,
    RecordedGoal,
    RecordedRun,
    RecordedView,
)
from active_recon.errors import DataError
from active_recon.meshes.photos import album_of
from active_recon.viewer.link import goal_lines, quality_lines
from active_recon.viewer.page import Page, slider_value
from active_recon.viewer.state import (
    LoopState,
    Observer,
    Scores,
    thumbnail,
)
from active_recon.viewer.view_result import Surface, ViewResult

PLAY = 'Play'
_STEP_S = 1.0  # seconds for each view


def recorded_states(run: RecordedRun) -> list[LoopState]:
    """Return the state after each view of a run, all episodes in their order."""
    return [state for episode in run.episodes for state in _episode_states(episode)]


def _episode_states(episode: RecordedEpisode) -> Iterator[LoopState]:
    observer = Observer()
    observer.begin_episode(episode.id, episode.begin)
    for view in episode.views:
        grid = view.occupied if view.reconstruction is None else view.reconstruction
        observer.add_view(
            ViewResult(view.stamp, view.camera, thumbnail(view.image), view.entropy,
                       quality=view.quality), grid,
            view.occupied)
        end = view.stamp
        if view.goal is not None:
            _set_goal(observer, view.goal.final)
            end = view.goal.final.stamp + 1
        if view is episode.views[-1]:
            observer.set_done(end, episode.done)
        yield observer.state


def _set_goal(observer: Observer, goal: RecordedGoal) -> None:
    observer.set_goal(goal.stamp, goal.camera)
    if goal.candidates is not None and goal.scores is not None:
        observer.set_scores(goal.stamp, Scores(goal.candidates.positions, goal.scores))
    if goal.reason is not None:
        observer.set_goal_reason(goal.stamp, goal.reason)


def colored_surface(state: LoopState, views: Sequence[RecordedView]) -> Surface | None:
    """Return the surface of a state in the colours of the views; None where it has none."""
    from active_recon.meshes.coloring import surface_colors  # only who asks for it waits

    grid, threshold = state.grid, state.threshold
    if grid is None or threshold is None or not grid.occupied(threshold).any():
        return None
    mesh = grid.mesh(threshold)
    found = surface_colors(mesh, album_of(
        [(view.image, view.camera) for view in views], grid.size).photos)
    return None if found is None else Surface(mesh.triangles, found.colors[mesh.faces])


class Playback:
    """
    A page on which a run is stepped through or played; call `draw` repeatedly.

    Raises DataError where the run has no view.
    """

    def __init__(self, run: RecordedRun, port: int = 0) -> None:
        self._states = recorded_states(run)
        self._views = [episode.views[:count] for episode in run.episodes
                       for count in range(1, len(episode.views) + 1)]
        self._colored: set[int] = set()
        if not self._states:
            raise DataError(f'{run.path}: no view: expected one or more, the run has none')
        grid = self._states[-1].grid
        self.page = Page(run.path.name, grid.size if grid is not None else 1.0, port)
        self.page.offer_colors()
        self._step = self.page.add_steps(len(self._states), 'View')
        self.page.add_button(PLAY, 'Play the views from here, or from the first.')
        self._stepped_at: float | None = None
        self.shown_text: list[str] = []

    @property
    def playing(self) -> bool:
        """Whether the run is playing."""
        return self._stepped_at is not None

    def draw(self, now: float) -> None:
        """Draw the selected view; `now` is any clock in seconds."""
        step = slider_value(self._step)
        if PLAY in self.page.clicks():
            self._stepped_at = now
            if step == len(self._states):
                self._step.value = step = 1
        if self._stepped_at is not None and now - self._stepped_at >= _STEP_S:
            self._stepped_at = now if step < len(self._states) else None
            self._step.value = step = min(step + 1, len(self._states))
        state = self._states[step - 1]
        if self.page.in_colors:
            state = self._with_surface(step - 1)
        self.shown_text = self._text(state)
        self.page.set_text(self.shown_text)
        self.page.draw(state)

    def _with_surface(self, step: int) -> LoopState:
        """Return the state of a step with its surface, made when it is first asked for."""
        if step not in self._colored:
            self._colored.add(step)
            self._states[step] = replace(self._states[step], surface=colored_surface(
                self._states[step], self._views[step]))
        return self._states[step]

    def _text(self, state: LoopState) -> list[str]:
        episodes = list(dict.fromkeys(known.episode for known in self._states))
        words = [f'View {len(state.views)} of '
                 f'{sum(known.episode == state.episode for known in self._states)}']
        if len(episodes) > 1:
            words[0] += f', episode {episodes.index(state.episode) + 1} of {len(episodes)}'
        words += [*quality_lines(state), *goal_lines(state)]
        if state.done:
            words.append(f'Done: {state.done.replace("_", " ")}.')
        return words
