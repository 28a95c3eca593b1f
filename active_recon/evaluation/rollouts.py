"""Batches of episodes with a frozen network and a view policy."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from active_recon.datasets.views import ViewSet
from active_recon.environment import run_episode, TimeStep
from active_recon.evaluation.exported_network import ExportedNetwork
from active_recon.geometry.cameras import azimuth_difference, pose_azimuths
from active_recon.models.network import ReconstructionNetwork, State
from active_recon.policies import Choice, Observation, Policy
from active_recon.policies.checked import begun_by, chosen
from active_recon.volumes.voxels import PUBLISHED_FLOOR
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Step:
    """
    B episodes after one more view.

    - occupancy: (B, R, R, R) in [0, 1]; latent: (B, C, h, w) float32
    - taken: azimuths of all views so far, radians, (B, t)
    """

    occupancy: Tensor
    latent: Tensor
    taken: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Seen:
    """B episodes after t views: the network's state, and the indices of the views, (B, t)."""

    state: State
    chosen: Tensor


class Shows(Protocol):
    """Feeds views of a set to a network, by the indices of objects (B,) and views (B,)."""

    views: ViewSet

    def initial_state(self, batch: int) -> State: ...

    def update(self, objects: Tensor, chosen: Tensor, state: State) -> State: ...


class RenderedObjects:
    """The environment of B objects of a set; an action is the index of a rendered view."""

    def __init__(self, shows: Shows, objects: Tensor) -> None:
        self._shows, self.objects = shows, objects

    def reset(self) -> None:
        """Begin an episode of each."""
        count = len(self.objects)
        self.seen = Seen(self._shows.initial_state(count), torch.empty(count, 0, dtype=torch.long))

    def step(self, view: Tensor) -> Seen:
        """Take a view of each object, (B,)."""
        state = self._shows.update(self.objects, view, self.seen.state)
        self.seen = Seen(state, torch.column_stack([self.seen.chosen, view]))
        return self.seen

    def azimuths(self, seen: Seen) -> NDArray[np.float64]:
        """Return the azimuths of all views so far, (B, t), radians."""
        return self._shows.views.azimuths[self.objects[:, None], seen.chosen].double().numpy()

    def observation(self, latent: Tensor, seen: Seen,
                    occupancy: Tensor | None = None) -> Observation:
        """
        Return the policy's observation, with all views of an object as candidates.

        `latent` is (B, C, h, w); `occupancy`, (B, R, R, R), is None for policies that do not use
        it.
        """
        poses = self._shows.views.poses
        published = None if occupancy is None else torch.where(
            occupancy > PUBLISHED_FLOOR, occupancy, 0).float().cpu().numpy()
        return Observation(
            latent.float().cpu().numpy(), poses[self.objects[:, None], seen.chosen].numpy(),
            poses[self.objects].numpy(), published)

    def goal_azimuths(self, choice: Choice) -> NDArray[np.float64]:
        """Return the azimuths of the goals that a policy chose, radians, (B,)."""
        own = pose_azimuths(self._shows.views.poses[self.objects].numpy())
        best = np.take_along_axis(own, choice.scores.argmax(axis=1)[:, None], axis=1)[:, 0]
        if choice.azimuth is None:
            return best
        return np.where(np.isnan(choice.azimuth), best, choice.azimuth)

    def view_of(self, choice: Choice) -> Tensor:
        """
        Return the views (B,) of a policy's choice: nearest to its azimuth, else best score.

        As on a robot, the best is one that was not taken yet, as long as there are such.
        """
        taken = np.zeros(choice.scores.shape, np.bool_)
        np.put_along_axis(taken, self.seen.chosen.numpy(), True, axis=1)
        scores = np.where(taken & ~taken.all(axis=1, keepdims=True), -np.inf, choice.scores)
        best = torch.from_numpy(scores.argmax(axis=1))
        if choice.azimuth is None:
            return best
        own = self._shows.views.azimuths[self.objects].numpy()
        proposed = nearest_views(own, np.nan_to_num(choice.azimuth))
        return torch.where(torch.from_numpy(np.isnan(choice.azimuth)), best, proposed)


@torch.inference_mode()
def roll_out(network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
             starts: Tensor, count: int, swapped: Tensor | None = None,
             bfloat16: bool = False) -> Iterator[Step]:
    """
    Run an episode of `count` views for each object (B,) from a first view (B,); yield every step.

    For an azimuth between views, the nearest rendered view is taken, as on the turntable. With
    `swapped`, (B,), the policy gets the latents of those objects from the same azimuths instead
    of the true ones.
    """
    observer = Observer(network, views, bfloat16)
    own = RenderedObjects(observer, objects)
    other = own if swapped is None else RenderedObjects(observer, swapped)
    other.reset()
    memory = begun_by(policy, len(objects))

    def choose(step: TimeStep[Tensor, Seen]) -> Tensor:
        nonlocal memory
        given = step.known
        if swapped is not None:
            at = own.azimuths(step.known)[:, -1]
            given = other.step(nearest_views(views.azimuths[swapped].numpy(), at))
        volume = observer.occupancy(given.state) if policy.wants_volume else None
        latent = given.state['latent']
        choice, memory = chosen(
            policy, own.observation(latent, step.known, volume), memory, len(objects))
        return own.view_of(choice)

    for step in run_episode(own, starts, choose, count):
        yield Step(observer.occupancy(step.known.state), step.known.state['latent'].float(),
                   own.azimuths(step.known))


class Observer:
    """Feeds views of a set, on white, to a frozen network; each view is encoded once."""

    def __init__(self, network: ReconstructionNetwork, views: ViewSet,
                 bfloat16: bool = False) -> None:
        self.views = views
        self._network, self._bfloat16 = network, bfloat16
        self._device = network.device
        self._rows: dict[tuple[int, int], int] = {}  # rows of `_encoded`, by object and view
        self._encoded: Tensor | None = None

    def initial_state(self, batch: int) -> State:
        """Return the network's state before any view."""
        return self._network.initial_state(batch)

    def update(self, objects: Tensor, chosen: Tensor, state: State,
               yaws: Tensor | None = None) -> State:
        """
        Return the state after views (B,) of objects (B,).

        The network's cameras are rotated about +z by `yaws` (B,), radians: an error of the
        object's front.
        """
        cameras = self.views.cameras(objects, chosen)
        if yaws is not None:
            cameras = cameras.turned(yaws)
        with self._precision():
            return self._network.update(
                self._encode(objects, chosen), cameras.to(self._device), state)

    def decode(self, state: State) -> Tensor:
        """Return the logits of occupancy of a state, (B, R, R, R) float32."""
        if not isinstance(self._network, ExportedNetwork):
            # torch's 3D convolutions take two thirds of the time with channels last
            state = {name: part.contiguous(memory_format=torch.channels_last_3d)
                     if part.ndim == 5 else part for name, part in state.items()}
        with self._precision():
            return self._network.decode(state).float()

    def occupancy(self, state: State) -> Tensor:
        """Return the occupancy of a state, (B, R, R, R) in [0, 1]."""
        return self.decode(state).sigmoid()

    def _encode(self, objects: Tensor, chosen: Tensor) -> Tensor:
        wanted = list(zip(objects.tolist(), chosen.tolist(), strict=True))
        fresh = [each for each in dict.fromkeys(wanted) if each not in self._rows]
        if fresh:
            index = torch.tensor(fresh).T
            images = self.views.white(*index).to(
                self._device, memory_format=torch.channels_last)
            encoded = self._network.encode(images, self.views.cameras(*index).to(self._device))
            self._rows |= {each: row for row, each in enumerate(fresh, start=len(self._rows))}
            self._encoded = (encoded if self._encoded is None
                             else torch.cat([self._encoded, encoded]))
        assert self._encoded is not None
        return self._encoded[torch.tensor([self._rows[each] for each in wanted])]

    def _precision(self) -> torch.autocast:
        return torch.autocast(self._device.type, torch.bfloat16, enabled=self._bfloat16)


def batches(count: int, size: int) -> Iterator[Tensor]:
    """Yield the indices of `count` rows, `size` at a time."""
    for low in range(0, count, size):
        yield torch.arange(low, min(low + size, count))


def nearest_views(azimuths: NDArray[np.float32], wanted: NDArray[np.float64]) -> Tensor:
    """Return the index (B,) of the view nearest to an azimuth, of azimuths (B, V), wanted (B,)."""
    away = np.abs(azimuth_difference(azimuths, wanted[:, None]))
    return torch.from_numpy(away.argmin(axis=1))
