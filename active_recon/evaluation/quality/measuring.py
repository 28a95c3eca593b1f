"""Roll-outs of a frozen network: what its quality is judged by after each view, and the truth."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self

from active_recon.datasets.views import ViewSet
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import DataError
from active_recon.evaluation.posed.walking import even_orders, Order
from active_recon.evaluation.quality.faults import FAULTS, sources_of
from active_recon.evaluation.quality.shells import HOLLOW, hollow_share
from active_recon.evaluation.rollouts import Observer, RenderedObjects, Seen
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.geometry.view_distance import on_one_ring, pose_directions
from active_recon.models.network import Cameras, ReconstructionNetwork
from active_recon.npz_files import read_npz
from active_recon.policies import Policy
from active_recon.quality.features import features
from active_recon.quality.latents import pooled
from active_recon.quality.silhouettes import SeenView
from active_recon.volumes.voxels import iou
from active_recon.whole_files import whole_file
import numpy as np
from numpy.typing import NDArray
import torch

LEARNED = 'attention'
_ANY = ', any'
KINDS = ('random', 'even', LEARNED)


@dataclass(frozen=True, eq=False)
class Measured:
    """
    N reconstructions, each after some views of an object.

    - numbers: (N, F), the features; latents: (N, D), pooled; iou: (N,) with the truth, NaN where a
      fault makes it meaningless; hollow: (N,), see `hollow_share`
    - count: (N,), views so far; episode: (N,), the same for all of one episode
    - object, source: (N,), names; fault: (N,), '' for none; kind: (N,), of KINDS, what chose the
      views, with `, any` where they are not of a turntable
    - weights: (N,), the sha256 of the network's weights
    """

    numbers: NDArray[np.float64]
    latents: NDArray[np.float64]
    iou: NDArray[np.float64]
    hollow: NDArray[np.float64]
    count: NDArray[np.int64]
    episode: NDArray[np.str_]
    object: NDArray[np.str_]
    source: NDArray[np.str_]
    fault: NDArray[np.str_]
    kind: NDArray[np.str_]
    weights: NDArray[np.str_]

    def __len__(self) -> int:
        """Return N."""
        return len(self.iou)

    def rows(self, chosen: NDArray[np.bool_]) -> Self:
        """Return some rows, by (N,) booleans."""
        return type(self)(**{each.name: getattr(self, each.name)[chosen] for each in fields(self)})

    @property
    def solid(self) -> Self:
        """The rows of objects that are not hollow."""
        return self.rows(self.hollow <= HOLLOW)

    @property
    def around(self) -> NDArray[np.bool_]:
        """Which views are of a turntable, (N,)."""
        return ~np.char.endswith(self.kind, _ANY)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return all rows of several; raises DataError where they are of several networks."""
        networks = {name for part in parts for name in part.weights.tolist()}
        if len(networks) > 1:
            raise DataError('quality: measured with several networks: expected files of one, got '
                            f'weights {", ".join(name[:12] for name in sorted(networks))}')
        return cls(**{each.name: np.concatenate([getattr(part, each.name) for part in parts])
                      for each in fields(cls)})

    def write(self, path: Path) -> None:
        """Write it as an npz file."""
        with whole_file(path) as unfinished, unfinished.open('wb') as file:
            np.savez_compressed(file, **{each.name: getattr(self, each.name)
                                         for each in fields(self)})

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read it again; raises DataError where it cannot be read."""
        try:
            return cls(**read_npz(path, [each.name for each in fields(cls)]))
        except (OSError, ValueError) as error:
            raise DataError(f'{path}: no measured qualities: expected a file that `active-recon '
                            f'quality measure` wrote, got: {error}') from error

    @classmethod
    def read_all(cls, paths: Sequence[Path], weights_sha256: str) -> Self:
        """Return all rows of files; raises DataError as `read`, and on those of other weights."""
        together = cls.joined([cls.read(path) for path in paths])
        for other in {*together.weights.tolist()} - {weights_sha256}:
            raise DataError(f'quality: measured with other weights: expected {weights_sha256[:12]}'
                            f', got {other[:12]}; give the right --model, or measure anew')
        return together


def orders_of(views: ViewSet, kind: str, count: int, seed: int) -> Order:
    """
    Return the first `count` views of each object, (N, count): evenly spread, or in random order.

    Of what a policy chooses, the first ones alone are taken from it.
    """
    shape = views.poses.shape[:2]
    rng = np.random.default_rng([seed, 20])
    if kind != 'even':
        return np.stack([rng.permutation(shape[1])[:count] for _ in range(shape[0])])
    first = rng.integers(shape[1], size=shape[0])
    return even_orders(pose_directions(views.poses.numpy()), count, first)


@torch.inference_mode()
def measure(views: ViewSet, network: ReconstructionNetwork, threshold: float, count: int,
            kind: str = 'random', fault: str = '', seed: int = 0,
            policy: Policy | None = None, weights_sha256: str = '') -> Measured:
    """
    Measure the objects of a set after 1 to `count` views each, all at once.

    A policy chooses the views after the first of each; `kind` is then its name. Views that are
    not of a turntable are of a kind of their own, `KIND, any`. Raises DataError where the network
    keeps no foreground, from which silhouettes are had.
    """
    shown = FAULTS[fault](views, seed) if fault else views
    # Each object by itself: which others are measured at the same time makes no difference
    called = np.array([kind if on_one_ring(places) else f'{kind}{_ANY}'
                       for places in views.poses[:, :, :3, 3].numpy()], '<U16')
    count = min(count, shown.poses.shape[1])
    order = torch.from_numpy(orders_of(shown, kind, count, seed))
    observer, objects = Observer(network, shown), torch.arange(len(shown))
    if 'foreground' not in observer.initial_state(len(shown)):
        raise DataError('quality: a network without a foreground: expected one that keeps the '
                        'foreground of each view in its state, as `lifting` does')
    seen: list[list[SeenView]] = [[] for _ in objects]
    found: list[tuple[NDArray[np.float64], NDArray[np.float64], float, int, int]] = []
    shows = RenderedObjects(observer, objects)
    choose = _ordered(order) if policy is None else _chosen_by(policy, observer, shows)
    for number, step in enumerate(run_episode(shows, order[:, 0], choose, count), 1):
        state, at = step.known.state, step.known.chosen[:, -1]
        foreground = state['foreground'].cpu().numpy()
        for row, camera in enumerate(_cameras(shown.cameras(objects, at), shown.image_size)):
            seen[row].append(SeenView(camera, *foreground[row]))
        occupancy = observer.occupancy(state).cpu().numpy()
        latents = pooled(state['latent'].cpu().numpy())
        for row, cells in enumerate(occupancy):
            truth = np.nan if fault else float(iou(cells > threshold, views.voxels[row].numpy()))
            found.append((features(cells, threshold, seen[row]), latents[row], truth, number,
                          row))
    numbers, pools, ious, counts, rows = zip(*found, strict=True)
    names = np.array([folder.full_name for folder in views.folders])
    at_row = np.array(rows)
    return Measured(
        np.array(numbers), np.array(pools), np.array(ious),
        np.array([hollow_share(truth.numpy()) for truth in views.voxels])[at_row],
        np.array(counts),
        np.array([f'{name} {own} {fault} {seed}'
                  for name, own in zip(names, called, strict=True)])[at_row], names[at_row],
        np.array(sources_of(views.folders))[at_row], np.full(len(rows), fault, '<U16'),
        called[at_row], np.full(len(rows), weights_sha256))


def _ordered(order: torch.Tensor) -> Callable[[TimeStep[torch.Tensor, Seen]], torch.Tensor]:
    return lambda step: order[:, step.known.chosen.shape[1]]


def _chosen_by(policy: Policy, observer: Observer, shows: RenderedObjects) -> Callable[
        [TimeStep[torch.Tensor, Seen]], torch.Tensor]:
    memory = policy.initial_state(len(shows.objects))

    def choose(step: TimeStep[torch.Tensor, Seen]) -> torch.Tensor:
        nonlocal memory
        state = step.known.state
        volume = observer.occupancy(state) if policy.wants_volume else None
        choice, memory = policy.choose(
            shows.observation(state['latent'], step.known, volume), memory)
        return shows.view_of(choice)

    return choose


def _cameras(cameras: Cameras, size: int) -> Iterator[Camera]:
    for pose, matrix in zip(cameras.poses.numpy(), cameras.intrinsics.numpy(), strict=True):
        yield Camera(pose, Intrinsics(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2],
                                      size, size))


def halves(measured: Measured, before: Collection[str] = ()) -> NDArray[np.bool_]:
    """
    Return which rows belong to the first of two halves, split by source, (N,).

    The sources, from that with most objects that are not hollow, each join the half with fewer of
    them so far. Where there are some of those that were the first half `before`, they are it
    again, whatever else was measured.
    """
    again = np.isin(measured.source, sorted(before))
    if again.any():
        return again
    solid = measured.solid
    pairs = set(zip(solid.source.tolist(), solid.object.tolist(), strict=True))
    sizes = [(-sum(source == each for source, _ in pairs), each)
             for each in sorted(set(measured.source.tolist()))]
    held: tuple[set[str], set[str]] = (set(), set())
    counts = [0, 0]
    for size, source in sorted(sizes):
        least = int(counts[1] < counts[0])
        held[least].add(source)
        counts[least] -= size
    return np.isin(measured.source, sorted(held[0]))
