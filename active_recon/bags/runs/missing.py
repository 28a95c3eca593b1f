"""What a recording lacks of the views of an episode."""

from collections.abc import Mapping, Sequence
from typing import Any

from active_recon.bags.runs.run import RecordedEpisode

_PLANNED = 'goal'
_REASON = 'reason of the goal'
_AFTER = (_PLANNED, _REASON)


def missing_parts(episode: RecordedEpisode) -> Mapping[str, Sequence[int]]:
    """Return the numbers of the views that lack a part, by the part; a goal follows its view."""
    qualities = [view.quality for view in episode.views]
    goals = [view.goal for view in episode.views[:-1]]
    reasons = [goal and goal.final.reason for goal in goals]
    parts: dict[str, list[Any]] = {
        'probabilities': [view.reconstruction for view in episode.views],
        'occupancy': [view.occupied for view in episode.views],
        'entropy': [view.entropy for view in episode.views],
        'latent': [view.latent for view in episode.views],
        # Not every network's weights have tables to judge it by
        'quality': qualities if any(qualities) else [],
        _PLANNED: goals,
        # Not every policy has reasons; without its goal one is not missed
        _REASON: [goal is None or reason for goal, reason in zip(goals, reasons, strict=True)]
        if any(reasons) else [],
    }
    without = {part: [number for number, value in enumerate(values, 1) if value is None]
               for part, values in parts.items()}
    return {part: numbers for part, numbers in without.items() if numbers}


def describe_missing(episode: RecordedEpisode) -> list[str]:
    """Return the missing parts in words, with the views unless it is all of them."""
    return [part if _of_all(episode, part, numbers) else _of_some(part, numbers)
            for part, numbers in missing_parts(episode).items()]


def describe_lost(episode: RecordedEpisode) -> list[str]:
    """Return in words the parts that some views lack but not all: they were lost on the way."""
    return [_of_some(part, numbers) for part, numbers in missing_parts(episode).items()
            if not _of_all(episode, part, numbers)]


def _of_all(episode: RecordedEpisode, part: str, numbers: Sequence[int]) -> bool:
    return len(numbers) == len(episode.views) - (part in _AFTER)


def _of_some(part: str, numbers: Sequence[int]) -> str:
    views = f'view{"s" if len(numbers) > 1 else ""} {", ".join(map(str, numbers))}'
    return f'the {part} {"after" if part in _AFTER else "of"} {views}'
