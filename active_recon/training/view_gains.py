"""What each next view would bring, measured on a frozen network: what a policy learns from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.evaluation.next_view.watching import Walk, WatchedObject
from active_recon.npz_files import read_npz
from active_recon.policies import Observation, Policy
from active_recon.whole_files import whole_file
import numpy as np
from numpy.typing import NDArray

_EXPLORED = 0.4  # share of the steps on which a random view is taken instead of the chooser's


@dataclass(frozen=True, eq=False)
class ViewGains:
    """
    S states of one object that V cameras look at, and what each camera would bring next.

    - poses: (V, 4, 4) float32, object from optical frame, lengths in sides of the grid
    - occupancy: (S, R, R, R) uint8, the published probabilities in 255ths
    - taken: (S, T) int16, the views of each state in order, by their numbers; -1: none
    - iou: (S,) float32, with the truth; after: (S, V) float32, the IoU after one more view, NaN
      for those taken
    """

    poses: NDArray[np.float32]
    occupancy: NDArray[np.uint8]
    taken: NDArray[np.int16]
    iou: NDArray[np.float32]
    after: NDArray[np.float32]

    def __len__(self) -> int:
        """Return S, the number of states."""
        return len(self.iou)

    @property
    def gains(self) -> NDArray[np.float32]:
        """The IoU that each view would add, (S, V), NaN for those taken."""
        return self.after - self.iou[:, None]

    def observation(self, row: int) -> Observation:
        """Return what a policy sees in a state: all views are its candidates."""
        poses = self.poses.astype(np.float64)[None]
        taken = self.taken[row][self.taken[row] >= 0]
        occupancy = self.occupancy[row:row + 1].astype(np.float32) / np.float32(255)
        return Observation(np.zeros((1, 0), np.float32), poses[:, taken], poses, occupancy)

    def save(self, path: Path) -> None:
        """Write the file (.npz), whole or not at all."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as unfinished, unfinished.open('wb') as file:
            np.savez_compressed(file, poses=self.poses, occupancy=self.occupancy,
                                taken=self.taken, iou=self.iou, after=self.after)

    @classmethod
    def load(cls, path: Path) -> 'ViewGains':
        """Read a file; raises DataError where it is not whole."""
        try:
            return cls(**read_npz(path, ('poses', 'occupancy', 'taken', 'iou', 'after')))
        except (OSError, ValueError) as error:
            raise DataError(f'{path}: no readable gains: expected a file that `train-policy` '
                            f'wrote, got: {error}; remove it') from error


Chooser = Callable[[WatchedObject, Walk], int]
"""Takes an object and the views so far; returns the next view, by its number."""


def measure_gains(watched: WatchedObject, chooser: Chooser, starts: int, count: int,
                  rng: np.random.Generator) -> ViewGains:
    """
    Return the states of episodes from `starts` first views, drawn, of 2 to `count` views each.

    Lengths are drawn too: what is chosen first matters most, as all later views gain by it. Each
    next view is that of a chooser, or by a chance of 0.4 a random one: a policy that is learned
    from the states must also know how to go on where it would not have gone.
    """
    poses = watched.views.poses[0].numpy().astype(np.float32)
    walks = []
    for first in rng.permutation(watched.count)[:starts]:
        walk = watched.begin(int(first))
        for left in reversed(range(int(rng.integers(2, min(count, watched.count) + 1)) - 1)):
            walks.append(walk)
            if left:
                walk = watched.step(walk, _next(watched, walk, chooser, rng))
    volumes = [watched.observation(walk, True).occupancy for walk in walks]
    longest = max(len(walk.taken) for walk in walks)
    return ViewGains(
        poses, np.concatenate([np.rint(volume * 255).astype(np.uint8)
                               for volume in volumes if volume is not None]),
        np.array([[*walk.taken, *[-1] * (longest - len(walk.taken))] for walk in walks], np.int16),
        np.array([watched.iou(walk) for walk in walks], np.float32),
        np.array([watched.ahead(walk).iou for walk in walks], np.float32))


def _next(watched: WatchedObject, walk: Walk, chooser: Chooser, rng: np.random.Generator) -> int:
    if rng.random() >= _EXPLORED:
        return chooser(watched, walk)
    return int(rng.choice([view for view in range(watched.count) if view not in walk.taken]))


def by_gain(watched: WatchedObject, walk: Walk) -> int:
    """Choose the view that brings most, as a perfect policy would."""
    return int(np.nanargmax(watched.ahead(walk).iou))


def by_policy(policy: Policy) -> Chooser:
    """Return the chooser of a policy without a state."""
    def choose(watched: WatchedObject, walk: Walk) -> int:
        seen = watched.observation(walk, policy.wants_volume)
        return int(policy.choose(seen, policy.initial_state(1))[0].scores[0].argmax())
    return choose


def some_views(views: ViewSet, numbers: Sequence[int]) -> ViewSet:
    """Return a set with some of the views of each object."""
    chosen = list(numbers)
    return replace(views, images=views.images[:, chosen], poses=views.poses[:, chosen],
                   intrinsics=views.intrinsics[:, chosen],
                   seen=None if views.seen is None else views.seen[:, chosen])


def spread_views(total: int, count: int, rng: np.random.Generator) -> list[int]:
    """Return the numbers of `count` of `total` views: every k-th where that fits, else drawn."""
    if count >= total:
        return list(range(total))
    if total % count == 0 and rng.random() < 0.5:
        step = total // count
        return list(range(int(rng.integers(step)), total, step))
    return sorted(int(view) for view in rng.choice(total, count, replace=False))
