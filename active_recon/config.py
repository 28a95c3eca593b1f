"""Frozen configurations: what is written beside the weights, and nothing a layer ever sees."""

from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from active_recon.errors import ConfigError

VOLUME_LOSSES = ('mse', 'bce', 'dice', 'mse+dice', 'bce+dice')
_RENAMED = {'varied': 'augment', 'short_share': 'curriculum_fraction', 'warm_up': 'warmup_steps',
            'episodes_alike': 'group_size'}


def with_current_keys(values: dict[str, Any]) -> dict[str, Any]:
    """Return saved settings, nested mappings too, with the keys that were renamed since."""
    return {_RENAMED.get(key, key): with_current_keys(value) if isinstance(value, dict) else value
            for key, value in values.items()}


@dataclass(frozen=True)
class Config:
    """A configuration that is read from a mapping and rejects unknown keys."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Return the configuration of a mapping; raises ConfigError naming unknown keys."""
        known = {field.name for field in fields(cls)}
        unknown = sorted(set(values) - known)
        if unknown:
            raise ConfigError(f'{cls.__name__}: unknown key {", ".join(unknown)}; '
                              f'expected keys out of {", ".join(sorted(known))}')
        lists_as_tuples = {key: tuple(value) if isinstance(value, list) else value
                           for key, value in values.items()}
        return cls(**lists_as_tuples)

    def to_dict(self) -> dict[str, Any]:
        """Return the plain mapping."""
        return asdict(self)


@dataclass(frozen=True)
class LossConfig(Config):
    """Weights of the losses of section 3.2, and the loss that compares voxels."""

    volume_weight: float = 0.4
    silhouette_weight: float = 0.6
    volume_loss: str = 'mse'  # mse (the paper), bce, dice, mse+dice, bce+dice

    def __post_init__(self) -> None:
        """Reject weights that train nothing."""
        if min(self.volume_weight, self.silhouette_weight) < 0 or not (
                self.volume_weight + self.silhouette_weight > 0):
            raise ConfigError('LossConfig: invalid weights: expected 0 or more, not both 0, got '
                              f'{self.volume_weight} and {self.silhouette_weight}')
        if self.volume_loss not in VOLUME_LOSSES:
            raise ConfigError('LossConfig: unknown volume loss: expected one of '
                              f'{", ".join(VOLUME_LOSSES)}, got {self.volume_loss!r}')


@dataclass(frozen=True)
class RewardConfig(Config):
    """
    The three-part reward of section 3.3; tau in radians. `paper_distance` is its 1 / d^2.

    The `group_size` episodes of a group begin with the same object and view, and the mean return
    of the others is part of each one's baseline; with 1, as in the paper, the learned baseline is
    used alone.
    """

    distance_weight: float = 0.02
    distance_tau: float = 0.5235987755982988
    paper_distance: bool = False
    policy_sigma: float = 0.35
    group_size: int = 1

    def __post_init__(self) -> None:
        """Reject widths that divide by 0."""
        if not (self.distance_tau > 0 and self.policy_sigma > 0 and self.distance_weight >= 0):
            raise ConfigError('RewardConfig: invalid tau, sigma or weight: expected tau and sigma '
                              f'above 0 and a weight of 0 or more, got {self.to_dict()}')
        if self.group_size < 1:
            raise ConfigError('RewardConfig: invalid group_size: expected 1 or more, got '
                              f'{self.group_size}')
