"""The networks to compare, with their thresholds and temperatures."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.evaluation.exported_network import network_in
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION

SIDES = (FINE_RESOLUTION, RESOLUTION)
"""Resolutions (cells a side) at which networks are measured, up to their own."""


@dataclass(frozen=True, eq=False)
class Entrant:
    """
    A network to measure.

    - thresholds: by cells a side, 64 and 32
    - temperatures: divisors of the logits, by number of views, fitted to cells near surfaces;
      empty where none were fitted
    - grid_temperatures: the same, fitted to cells anywhere, for the expected IoU. Temperatures
      fitted near surfaces, where cells are uncertain, would make all of empty space uncertain
    - chosen_on: the source of thresholds and temperatures: 'card' or a validation folder
    - weights: SHA-256 of the weights file; path: where it lies, None: nowhere
    """

    name: str
    network: ReconstructionNetwork
    thresholds: Mapping[int, float]
    temperatures: Mapping[int, float] = field(default_factory=dict)
    grid_temperatures: Mapping[int, float] = field(default_factory=dict)
    chosen_on: str = 'card'
    weights: str = ''
    path: Path | None = None

    @property
    def sides(self) -> tuple[int, ...]:
        """Resolutions at which it can be measured: its own, and that halved once or twice."""
        own = self.network.resolution
        return tuple(side for side in SIDES if own in (side, 2 * side, 4 * side))


def load_entrants(models: str, runtime: str = 'torch', bfloat16: bool = False,
                  threads: int = 2) -> list[Entrant]:
    """
    Load networks named `MODEL,MODEL,...`: each a model that ships, a file, or `NAME=FILE`.

    Paths may have `=` in them, names no slash. For what runs them see `network_in`, which raises
    too. Raises ConfigError on an empty list, where two have the same name, or where one has no
    resolution that data have; WeightsError where weights are missing.
    """
    entrants: list[Entrant] = []
    for asked in filter(None, (part.strip() for part in models.split(','))):
        name, named, file = asked.partition('=')
        is_named = bool(named) and '/' not in name and not Path(asked).is_file()
        path = find_weights(file if is_named else asked)
        bundle = load_weights(path)
        name = name if is_named else Path(path).stem
        if any(other.name == name for other in entrants):
            raise ConfigError('models: ambiguous name: expected a different name for each, got '
                              f'{name!r} twice; name one as NAME=FILE')
        network = network_in(runtime, path, bundle, bfloat16, threads)
        entrants.append(Entrant(name, network, dict.fromkeys(
            SIDES, bundle.threshold), weights=weights_hash(path), path=path))
        if not entrants[-1].sides:
            raise ConfigError(f'{name}: no true voxels to measure it with: expected a network of '
                              f'32 or 64 cells a side, got {network.resolution}')
    if not entrants:
        raise ConfigError('models: empty list: expected one or more, separated by commas, got '
                          'none')
    return entrants
