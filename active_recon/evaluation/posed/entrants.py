"""The networks that are measured beside each other, each with what was chosen for it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION

SIDES = (FINE_RESOLUTION, RESOLUTION)
"""Cells a side at which networks are measured, as far as they have them."""


@dataclass(frozen=True, eq=False)
class Entrant:
    """
    A network to measure.

    - thresholds: by cells a side, 64 and 32
    - temperatures: by number of views; what divides its logits, fitted to cells near surfaces.
      None were fitted where empty
    - grid_temperatures: the same, fitted to cells anywhere, as the expected IoU asks for: near
      surfaces cells are so doubtful that, divided alike, all of empty space becomes so too
    - chosen_on: what they were chosen on: the weights' card, or a validation folder
    - weights: SHA-256 of its file
    """

    name: str
    network: ReconstructionNetwork
    thresholds: Mapping[int, float]
    temperatures: Mapping[int, float] = field(default_factory=dict)
    grid_temperatures: Mapping[int, float] = field(default_factory=dict)
    chosen_on: str = 'card'
    weights: str = ''

    @property
    def sides(self) -> tuple[int, ...]:
        """Cells a side at which it can be measured: its own, and by halves fewer."""
        own = self.network.resolution
        return tuple(side for side in SIDES if own in (side, 2 * side, 4 * side))


def load_entrants(models: str) -> list[Entrant]:
    """
    Load networks named as `MODEL,MODEL,...`: each a shipped model, a file, or `NAME=FILE`.

    Raises ConfigError where two have one name, WeightsError where weights are missing.
    """
    entrants: list[Entrant] = []
    for asked in filter(None, (part.strip() for part in models.split(','))):
        name, named, file = asked.rpartition('=')
        path = find_weights(file)
        bundle = load_weights(path)
        name = name if named else Path(path).stem
        if any(other.name == name for other in entrants):
            raise ConfigError('models: ambiguous name: expected a name of its own for each, got '
                              f'{name!r} twice; name one as NAME=FILE')
        entrants.append(Entrant(name, bundle.reconstruction, dict.fromkeys(
            SIDES, bundle.threshold), weights=weights_hash(path)))
    if not entrants:
        raise ConfigError('models: empty list: expected one or more, separated by commas, got '
                          'none')
    return entrants
