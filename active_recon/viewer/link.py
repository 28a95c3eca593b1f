"""The status of the connection to the loop, as lines of text."""

from collections.abc import Mapping
from dataclasses import dataclass

from active_recon.geometry.cameras import whole_degrees
from active_recon.viewer.state import LoopState

_SILENT_S = 2.0


@dataclass(frozen=True)
class TopicLink:
    """A topic's full name, its publishers, and the age of its last message (None: none came)."""

    topic: str
    publishers: int
    age_s: float | None = None


def status_lines(links: Mapping[str, TopicLink], state: LoopState,
                 problems: Mapping[str, str] | None = None) -> list[str]:
    """
    Return the status of the connection and the episode, the most important line first.

    `links` are the topics by their role: 'image', 'view', 'occupancy', 'goal'. `problems` are
    those that nodes report, by their names.
    """
    warnings = [f'{name}: {problem}' for name, problem in sorted((problems or {}).items())]
    if not any(link.publishers or link.age_s is not None for link in links.values()):
        return ['Waiting for a loop: no publisher yet on '
                f'{", ".join(link.topic for link in links.values())}.', *warnings]
    lines = [_progress(links['view'], state), *quality_lines(state), *goal_lines(state),
             *warnings]
    for link in links.values():
        if not link.publishers:
            lines.append(f'No publisher on {link.topic} '
                         f'{"yet" if link.age_s is None else "any more"}.')
    silent_s = links['image'].age_s
    if links['image'].publishers and silent_s is not None and silent_s > _SILENT_S:
        lines.append(f'No image for {ago(silent_s)}.')
    if state.episode:
        lines.append(f'Episode {state.episode}.')
    return lines


def quality_lines(state: LoopState) -> list[str]:
    """Return how good the shape is after the last view, and a warning; none if not known."""
    quality = state.views[-1].quality if state.views else None
    if quality is None:
        return []
    summary = f'{quality.summary[0].upper()}{quality.summary[1:]}.'
    return [summary, *filter(None, [quality.warning])]


def goal_lines(state: LoopState) -> list[str]:
    """Return why the next view is worth taking; none if that is not known."""
    if state.goal is None or state.goal_reason is None:
        return []
    return [f'Next view, {whole_degrees(state.goal.azimuth)}°: {state.goal_reason.sentence}.']


def ago(seconds: float) -> str:
    """Return a duration in whole units: '3 s', '2 min', '1 h'."""
    if seconds < 60:
        return f'{seconds:.0f} s'
    return f'{seconds / 60:.0f} min' if seconds < 3600 else f'{seconds / 3600:.0f} h'


def _progress(link: TopicLink, state: LoopState) -> str:
    if not state.views or link.age_s is None:
        return 'No view in this episode yet.'
    count = state.missed + len(state.views)
    last = f'{count} view{"s" if count > 1 else ""}, the last {ago(link.age_s)} ago.'
    return f'Done ({state.done.replace("_", " ")}): {last}' if state.done else last
