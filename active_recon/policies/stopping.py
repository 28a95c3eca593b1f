"""When an episode has views enough, and for which reason."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.errors import ConfigError
from active_recon.quality.quality import Quality
import numpy as np


@dataclass(frozen=True)
class StoppingRule:
    """
    The reasons to end an episode.

    - max_views: it has as many views
    - entropy_tolerance: its last two views each changed the entropy by at most this share; 0 for
      never
    - target_quality: that IoU is promised, or is out of reach; 0 for none
    - min_gain: no further view is worth as much of IoU; 0 for any

    Raises ConfigError on values out of range.
    """

    max_views: int = 5
    entropy_tolerance: float = 0.01
    target_quality: float = 0.0
    min_gain: float = 0.0

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if self.max_views < 1:
            raise ConfigError(f'max_views: too few: expected 1 or more, got {self.max_views}')
        if not 0 <= self.entropy_tolerance < 1:
            raise ConfigError('entropy_tolerance: out of range: expected a share in [0, 1), got '
                              f'{self.entropy_tolerance}')
        for name in ('target_quality', 'min_gain'):
            if not 0 <= getattr(self, name) < 1:
                raise ConfigError(f'{name}: out of range: expected an IoU in [0, 1), got '
                                  f'{getattr(self, name)}')

    def reason(self, entropies: Sequence[float], quality: Quality | None,
               worth: float | None, learned_around: bool = False) -> str:
        """
        Return why no further view is needed, '' where one is.

        It is one of target_reached, max_views, target_out_of_reach, entropy_settled and
        gain_too_small. `entropies` are those after each view, nats, NaN where it is not known;
        `quality` is that after the last, which ends nothing while its views are flagged as
        unusual; `worth` is what the best further view is expected to gain, None where that is not
        known; `learned_around` is whether the policy of the weights chooses views of a turntable,
        for which promises are its own.
        """
        known = quality if self.target_quality and quality and not quality.suspect else None
        if known is not None and known.promise_for(learned_around) >= self.target_quality:
            return 'target_reached'
        if len(entropies) >= self.max_views:
            return 'max_views'
        if known is not None and known.attainable < self.target_quality:
            return 'target_out_of_reach'
        if self._settled(entropies):
            return 'entropy_settled'
        return self.reason_of_gain(worth)

    def reason_of_gain(self, worth: float | None) -> str:
        """Return 'gain_too_small' where the best further view is not worth it, '' elsewhere."""
        is_small = self.min_gain and worth is not None and worth < self.min_gain
        return 'gain_too_small' if is_small else ''

    def _settled(self, entropies: Sequence[float]) -> bool:
        """Whether the last two views each changed the entropy by no more than the tolerance."""
        if self.entropy_tolerance == 0 or len(entropies) < 3:
            return False
        recent = np.array(entropies[-3:])
        change = np.abs(np.diff(recent)) / np.maximum(recent[:-1], 1e-9)
        return bool((change <= self.entropy_tolerance).all())
