"""A trial of a network that may be somebody's own, before hours of training depend on it."""

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.models.network import Cameras, ReconstructionNetwork
from active_recon.models.registry import NetworkEntry
import torch
from torch import Tensor


def built_and_tried(entry: NetworkEntry, config: Config, name: str) -> ReconstructionNetwork:
    """Return a network that is somebody's own; raises ConfigError as `try_network` does."""
    try:
        network = entry.build(config)
    except Exception as error:  # whatever its constructor raises
        raise ConfigError(f'{name}: cannot be built: expected a network of its {config}, got '
                          f'{type(error).__name__}: {error}') from error
    try_network(network, name)
    return network


@torch.no_grad()
def try_network(network: ReconstructionNetwork, name: str) -> None:
    """
    Show a network two blank views of two objects, and look at what it returns.

    Raises ConfigError in one line where it fails, modifies the state that it is given, where the
    occupancy is not finite, or where something has another shape than its interface tells, see
    `ReconstructionNetwork`.
    """
    side, cells = (getattr(network, each, None) for each in ('image_size', 'resolution'))
    front = getattr(network, 'needs_front', None)
    if not (isinstance(side, int) and isinstance(cells, int) and isinstance(front, bool)):
        raise ConfigError(f'{name}: no network of this interface: expected image_size and '
                          'resolution (int) and needs_front (bool), got '
                          f'{side!r}, {cells!r} and {front!r}')
    camera: Camera = orbit_camera(0.0)
    camera = Camera(camera.pose, camera.intrinsics.resized(side, side))
    cameras = Cameras.of([camera] * 2).to(network.device)
    images = torch.ones(2, 3 if front else 4, side, side, device=network.device)
    try:
        state, modified = network.initial_state(2), set[str]()
        for _ in range(2):
            before = {key: each.clone() for key, each in state.items()}
            logits, after = network(images, cameras, state)
            modified |= {key for key in before.keys() | state.keys()
                         if not _is_same(before.get(key), state.get(key))}
            state = after
        latent = state.get('latent')
        found = {key: tuple(each.shape) for key, each in state.items()}
    except Exception as error:
        raise ConfigError(f'{name}: fails on two views of {tuple(images.shape)}: '
                          f'{type(error).__name__}: {error}') from error
    if modified:  # then a second view from one state, as searches take, begins elsewhere
        raise ConfigError(f'{name}: the given state is modified: expected a new one of update, '
                          f'got other {", ".join(sorted(modified))} in the one it was given')
    if tuple(logits.shape) != (2, cells, cells, cells):
        raise ConfigError(f'{name}: wrong occupancy: expected logits (2, {cells}, {cells}, '
                          f'{cells}) of decode, got {tuple(logits.shape)}')
    if not torch.isfinite(logits).all():
        raise ConfigError(f'{name}: no usable occupancy: expected finite logits of decode, got '
                          f'{(~torch.isfinite(logits)).sum()} of {logits.numel()} NaN or infinite')
    if latent is None or latent.ndim != 4 or len(latent) != 2:
        raise ConfigError(f'{name}: no latent: expected (2, C, h, w) as `latent` in the state, '
                          f'got {found}')


def _is_same(one: Tensor | None, other: Tensor | None) -> bool:
    """Return whether two entries of a state have the same numbers, or neither is there."""
    if one is None or other is None:
        return one is other
    return one.shape == other.shape and torch.allclose(one, other, 0, 0, equal_nan=True)
