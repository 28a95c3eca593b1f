"""The latency from an image to the goal that follows from it, by stages."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from statistics import median_low
from typing import NamedTuple

from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedView

NS_PER_MS = 1e6
ONE_CLOCK_S = 60.0
"""The longest plausible time from stamp to recording; beyond it the clocks differ."""


class Stage(NamedTuple):
    """A stage: its name, its meaning, and the messages whose arrival ends it."""

    name: str
    meaning: str
    ends_with: tuple[str, ...]


STAGES = (
    Stage('transport', 'from the exposure until the image was recorded', ('camera/image_raw',)),
    Stage('reconstruct', 'until the reconstruction was published',
          ('occupancy',)),
    Stage('hand over', 'until all messages for the planner were published',
          ('latent', 'view', 'entropy')),
    Stage('decide', 'until the planner published the next goal', ('goal',)),
)


@dataclass(frozen=True)
class Timing:
    """
    Milliseconds of one view, None if not recorded.

    `stages` are those of STAGES, `total` is from the image to the goal, `turn` from the goal of
    the view to its image. Times are those of the recorder; a stage that ended before the one
    before it took 0.
    """

    stages: tuple[float | None, ...]
    total: float | None
    turn: float | None


_UNKNOWN = Timing((None,) * len(STAGES), None, None)


def timings(episode: RecordedEpisode, measured: bool = True) -> list[Timing]:
    """Return the timing of each view: nothing where it was not `measured`, as in a replay."""
    if not measured:
        return [_UNKNOWN] * len(episode.views)
    asked = [episode.first_goal, *(view.goal for view in episode.views)]
    return [_timing(view, goal and goal.final)
            for view, goal in zip(episode.views, asked, strict=False)]


def two_clocks(view: RecordedView) -> bool:
    """Return whether an image's stamp and the recorder's times are from different clocks."""
    return any(not 0 <= arrival - view.stamp <= ONE_CLOCK_S * 1e9
               for arrival in view.received.values())


def median(values: Sequence[float | None]) -> float | None:
    """Return the lower median of the known values, None if there are none."""
    known = [value for value in values if value is not None]
    return median_low(known) if known else None


def _timing(view: RecordedView, asked: RecordedGoal | None) -> Timing:
    arrivals = dict(view.received)
    if view.goal is not None:
        arrivals['goal'] = view.goal.received
    stamp = None if two_clocks(view) else view.stamp
    ends = [max((arrivals[name] for name in stage.ends_with if name in arrivals), default=None)
            for stage in STAGES]
    marks = list(accumulate([stamp, *ends], _no_earlier))
    known = [mark if end is not None else None
             for mark, end in zip(marks, [stamp, *ends], strict=True)]
    turn = None if asked is None else _ms(asked.received, stamp)
    return Timing(tuple(_ms(start, end) for start, end in pairwise(known)),
                  _ms(known[0], known[-1]), None if turn is None or turn < 0 else turn)


def _no_earlier(before: int | None, end: int | None) -> int | None:
    """Return the later of two times; None is unknown."""
    return end if before is None else before if end is None else max(before, end)


def _ms(start: int | None, end: int | None) -> float | None:
    return None if start is None or end is None else (end - start) / NS_PER_MS
