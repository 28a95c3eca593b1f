"""One object as one episode: the one loop over views, whatever shows them and whoever chooses."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

View = TypeVar('View')
Known = TypeVar('Known')
Seen = TypeVar('Seen', covariant=True)
Asked = TypeVar('Asked', contravariant=True)


class Environment(Protocol[Asked, Seen]):
    """
    An object, or a batch of them, that is looked at view by view, and what becomes known of it.

    What a view is, is the environment's own: an index of a rendered view, a recorded image, ...
    """

    def reset(self) -> None:
        """Begin an episode: nothing was seen yet."""
        ...

    def step(self, view: Asked) -> Seen:
        """Take a view, and return what is known then."""
        ...


@dataclass(frozen=True, eq=False)
class TimeStep(Generic[View, Known]):
    """
    An episode after one more view.

    - number: of the view, from 1 on; view: which it was; known: what is known after it
    - last: whether the episode was to have no more views than this
    """

    number: int
    view: View
    known: Known
    last: bool


def run_episode(environment: Environment[View, Known], first: View,
                choose: Callable[[TimeStep[View, Known]], View | None],
                count: int | None = None) -> Iterator[TimeStep[View, Known]]:
    """
    Run an episode from its first view on, yielding every view.

    `choose` names the next view after each but the last; None ends the episode. `count` is the
    most views that it has, None: as many as are chosen.
    """
    environment.reset()
    view: View | None = first
    number = 0
    while view is not None:
        number += 1
        step = TimeStep(number, view, environment.step(view), number == count)
        yield step
        view = None if step.last else choose(step)
