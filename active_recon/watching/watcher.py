"""The loop over photos that arrive: each is taken in, and it is told where the next one stands."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
import threading

from active_recon.errors import DataError
from active_recon.photos.shape import Shape
from active_recon.watching.advice import Advice, Adviser, ENOUGH
from active_recon.watching.arrivals import Arrivals, SETTLED_S
from active_recon.watching.collection import Collection, Files
from active_recon.watching.directions import where_to_stand
from active_recon.watching.sketch import sketch
import numpy as np
from numpy.typing import NDArray

_SHOWN_LEFT_OUT = 5  # on the page; the terminal has them all


@dataclass(frozen=True, eq=False)
class Progress:
    """
    What is known after the photos so far.

    - lines: in words, the most important one first; enough: whether a photo is asked for no more
    - shape, advice: None while there is none; sketch: see `sketch`, None likewise
    """

    lines: Sequence[str] = ('Waiting for the first photo.',)
    shape: Shape | None = None
    advice: Advice | None = None
    sketch: NDArray[np.uint8] | None = None

    @property
    def has_goal(self) -> bool:
        """Whether a place is told, which may be skipped."""
        return self.advice is not None and self.advice.goal is not None

    @property
    def enough(self) -> bool:
        """Whether there are photos enough."""
        return self.advice is not None and bool(self.advice.done)


@dataclass(eq=False)
class Verdicts:
    """What became of photos, by their names, for threads that wait for it."""

    _known: dict[str, str] = field(default_factory=dict)
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def put(self, name: str, left_out: str) -> None:
        """Tell why a photo was left out; '' where it was not."""
        with self._changed:
            self._known[name] = left_out
            self._changed.notify_all()

    def wait(self, name: str, seconds: float) -> str | None:
        """Return why a photo was left out, '' where it was not; None if that is not known yet."""
        with self._changed:
            self._changed.wait_for(lambda: name in self._known, seconds)
            return self._known.get(name)


@dataclass(frozen=True, eq=False)
class _Skip:
    """That the place which was told is to be left out, and whether that is done."""

    told: Progress
    done: threading.Event = field(default_factory=threading.Event)


class Watcher:
    """
    Takes photos in as they arrive in a folder; call `step` repeatedly, from one thread.

    `say` gets what happened, line by line. Other threads may read `progress`, which is replaced
    and never changed, wait for `verdicts`, and `skip`.
    """

    def __init__(self, folder: Path, collection: Collection, adviser: Adviser,
                 say: Callable[[str], None]) -> None:
        self._arrivals = Arrivals(folder)
        self._collection = collection
        self._adviser = adviser
        self._say = say
        self._queue: list[Path] = []
        self._left_out: dict[str, str] = {}
        self._away = ''
        self._cameras: tuple[Files, float] = {}, 0.0
        self._skips: deque[_Skip] = deque()
        self._skipped: list[NDArray[np.float64]] = []  # places in the world of the cameras
        self.progress = Progress()
        self.verdicts = Verdicts()

    def skip(self, seconds: float = 0.0) -> None:
        """
        Ask for another place than the one that is told now, for good, as nobody can stand there.

        Done by the next `step`, for which another thread may wait, at most so many seconds.
        """
        asked = _Skip(self.progress)
        self._skips.append(asked)
        asked.done.wait(seconds)

    def step(self, now: float) -> bool:
        """
        Take in what has changed in the folder, at most as many photos as there were before.

        Return whether it was anything. `now` is any clock in seconds.
        """
        if self._skips:
            self._leave_out(self._skips.popleft())
            return True
        gone = self._arrivals.gone()
        self._collection.remove(*gone)
        for path in gone:
            self._left_out.pop(path.name, None)
            for name in [name for name, why in self._left_out.items()
                         if why.endswith(f': the same photo as {path.name}')]:
                del self._left_out[name]
                self._queue.append(path.with_name(name))  # it is the only one now
            self._say(f'{path.name}: {"changed" if path.exists() else "gone from the folder"}')
        self._queue = [path for path in (*self._queue, *self._arrivals.arrived(now))
                       if path not in gone]
        if self._arrivals.away not in ('', self._away):
            self._say(f'{self._arrivals.away}; the photos so far stay, and it is looked for again')
        self._away = self._arrivals.away
        if not self._queue or self._away:
            changed = self._have_cameras_changed(now)
            if changed:
                self._skipped.clear()  # they may stand in another world
                wrong = self._collection.read_cameras_again()
                self._say('the cameras have changed'
                          + (f', and are not used: {wrong}' if wrong else ''))
            if gone or changed:
                self._tell()
            return bool(gone) or changed
        # A shape is made of all photos anew: one for each photo of a full folder would take long
        count = max(1, self._collection.count)
        taken, self._queue = self._queue[:count], self._queue[count:]
        reasons = dict(zip((path.name for path in taken), self._collection.add_all(taken),
                           strict=True))
        for name, left_out in reasons.items():
            if left_out:
                self._left_out[name] = left_out
            self._say(f'left out: {left_out}' if left_out else f'{name}: taken in')
        self._tell()
        for name, left_out in reasons.items():
            self.verdicts.put(name, left_out)
        return True

    def _leave_out(self, asked: '_Skip') -> None:
        """Leave out a place that was told, unless another one is told meanwhile."""
        shape, advice = asked.told.shape, asked.told.advice
        if asked.told is self.progress and shape and advice and advice.goal:
            place = shape.world_from_object @ (*advice.goal.camera.position, 1.0)
            self._skipped.append(place[:3])
            self._say('left out: that place; another one is looked for')
            self._tell()
        asked.done.set()

    def _have_cameras_changed(self, now: float) -> bool:
        """Return whether there are other cameras than those of the shape, in whole files."""
        found = self._collection.new_cameras()
        if found != self._cameras[0]:
            self._cameras = found, now
        return bool(found) and now - self._cameras[1] >= SETTLED_S

    def result(self) -> Shape:
        """Return the shape of all photos so far; raises DataError where there is none."""
        shape = self._collection.shape
        if shape is None:
            raise DataError(f'no shape: expected photos of an object, got: '
                            f'{self._collection.waiting}', 'no_photos')
        return replace(shape, left_out=self._all_left_out(shape))

    def _all_left_out(self, shape: Shape | None) -> list[str]:
        """Return why photos are left out of a shape now, whatever became of them at first."""
        if shape is None:
            return list(self._left_out.values())
        used = {view.name for view in shape.views}
        now = {reason.partition(': ')[0]: reason for reason in shape.left_out}
        return [reason for name, reason in {**self._left_out, **now}.items() if name not in used]

    def _tell(self) -> None:
        """Say where to stand next, and show it."""
        shape = self._collection.shape
        out = [f'Left out: {reason}' for reason in self._all_left_out(shape)[-_SHOWN_LEFT_OUT:]]
        if shape is None:
            waiting = self._collection.waiting
            self.progress = Progress([f'{waiting[0].upper()}{waiting[1:]}.', *out])
            self._say(self.progress.lines[0])
            return
        advice = self._adviser.advice(shape, self._skipped)
        lines = told(shape, advice, self._collection.metric)
        for line in lines[:2]:
            self._say(line)
        board = self._collection.board
        self.progress = Progress(
            [*lines, *out], shape, advice,
            sketch(shape, None if advice.goal is None else advice.goal.camera,
                   None if board is None else board.board))


def told(shape: Shape, advice: Advice, metric: bool) -> list[str]:
    """Return in words where the next photo stands or why there are enough, and how good it is."""
    goal = advice.goal
    way = '' if goal is None else where_to_stand(
        goal.camera, shape.views[-1].camera, metric)
    another = f' Another one would stand {way}.' if way else ''
    lines = ([f'Enough photos: {ENOUGH[advice.done]}.{another}'] if advice.done
             else [f'Next: {way}.'])
    count = len(shape.views)
    quality = '' if shape.quality is None else f'; {shape.quality.summary}'
    lines.append(f'{count} photo{"s" if count > 1 else ""}{quality}.')
    if goal is not None and goal.gain is not None:
        lines.append(f'The next photo is expected to gain {goal.gain:z.3f} of IoU.')
    return [*lines, *(f'Warning: {warning}' for warning in shape.warnings)]
