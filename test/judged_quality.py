"""Quality tables of no network, and what they are asked about."""

from active_recon.quality.features import FEATURES
from active_recon.quality.quality import Quality
from active_recon.quality.tables import QualityTables
import numpy as np

CHANNELS, COUNTS = 3, 4


def some_tables(sha256='none', seed=0):
    """Return tables of random numbers, for latents of three channels and up to four views."""
    rng = np.random.default_rng(seed)
    size, width = len(FEATURES) + 1, 2 * CHANNELS
    def table(*shape):
        return np.round(rng.normal(size=shape), 3).tolist()
    return QualityTables(
        sha256, table(size), np.abs(rng.normal(size=size) + 2).round(3).tolist(),
        (0.1 * rng.normal(size=2 * size)).round(3).tolist(), table(COUNTS), table(width),
        np.eye(width).tolist(), ['pose', 'mask'], table(2, size + 1), margin=[0.2] * COUNTS,
        targets=[0.5, 0.7], needed=[0.6, 0.85], growth=[0.3, 0.2, 0.1, 0.0],
        usual_scores=[sorted(table(50)) for _ in range(COUNTS)],
        usual_distances=[sorted(table(50)) for _ in range(COUNTS)])


def quality_of(expected=0.6, promise=0.0, attainable=1.0, suspect='',
               promise_learned=None):
    """Return a quality that is as good as it is told."""
    return Quality(expected, max(expected - 0.2, 0.0), promise, attainable,
                   0.01 if suspect else 0.6, 0.9, suspect, promise_learned)
