"""The environment of an episode, and the one loop over its views."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

View = TypeVar('View')
Known = TypeVar('Known')
Seen = TypeVar('Seen', covariant=True)
Asked = TypeVar('Asked', contravariant=True)


class Environment(Protocol[Asked, Seen]):
    """
    An object, or a batch of objects, that is viewed step by step.

    The type of a view depends on the environment: the index of a rendered view, an image, ...
    """

    def reset(self) -> None:
        """Begin an episode, before any view."""
        ...

    def step(self, view: Asked) -> Seen:
        """Take a view, and return the observation after it."""
        ...


@dataclass(frozen=True, eq=False)
class TimeStep(Generic[View, Known]):
    """
    An episode after one more view.

    - number: of the view, from 1 on; view: the view itself; known: the observation after it
    - last: whether it is the last view of the episode
    """

    number: int
    view: View
    known: Known
    last: bool


def run_episode(environment: Environment[View, Known], first: View,
                choose: Callable[[TimeStep[View, Known]], View | None],
                count: int | None = None) -> Iterator[TimeStep[View, Known]]:
    """
    Run an episode from its first view on, yielding every step.

    `choose` returns the next view after each but the last; None ends the episode. `count` limits
    the number of views; None is no limit.
    """
    environment.reset()
    view: View | None = first
    number = 0
    while view is not None:
        number += 1
        step = TimeStep(number, view, environment.step(view), number == count)
        yield step
        view = None if step.last else choose(step)
