"""The state of the link to the loop, in plain words."""

from collections.abc import Mapping
from dataclasses import dataclass

from active_recon.viewer.state import LoopState

_SILENT_S = 2.0


@dataclass(frozen=True)
class TopicLink:
    """A topic by its full name, its publishers now, and seconds since it spoke (None: never)."""

    topic: str
    publishers: int
    heard_ago_s: float | None = None


def link_words(links: Mapping[str, TopicLink], state: LoopState,
               problems: Mapping[str, str] | None = None) -> list[str]:
    """
    Return what a person should know of the link and the episode, the most telling first.

    `links` are the topics that matter by their role: 'image', 'view', 'occupancy', 'goal'.
    `problems` are what nodes say is wrong, by their names.
    """
    warnings = [f'{name} warns: {words}' for name, words in sorted((problems or {}).items())]
    if not any(link.publishers or link.heard_ago_s is not None for link in links.values()):
        return ['Waiting for a loop: nobody publishes on '
                f'{", ".join(link.topic for link in links.values())} yet.', *warnings]
    words = [_progress(links['view'], state), *warnings]
    for link in links.values():
        if not link.publishers:
            words.append(f'No publisher on {link.topic} '
                         f'{"yet" if link.heard_ago_s is None else "any more"}.')
    silent_s = links['image'].heard_ago_s
    if links['image'].publishers and silent_s is not None and silent_s > _SILENT_S:
        words.append(f'The camera has been silent for {ago(silent_s)}.')
    if state.episode:
        words.append(f'Episode {state.episode}.')
    return words


def ago(seconds: float) -> str:
    """Return a span of time as a person says it: '3 s', '2 min', '1 h'."""
    if seconds < 60:
        return f'{seconds:.0f} s'
    return f'{seconds / 60:.0f} min' if seconds < 3600 else f'{seconds / 3600:.0f} h'


def _progress(link: TopicLink, state: LoopState) -> str:
    if not state.views or link.heard_ago_s is None:
        return 'No view in this episode yet.'
    count = len(state.views)
    last = f'{count} view{"s" if count > 1 else ""}, the last {ago(link.heard_ago_s)} ago.'
    return f'Done ({state.done.replace("_", " ")}): {last}' if state.done else last
