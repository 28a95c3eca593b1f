"""The numbers that the quality of a network's reconstructions is judged by, in a JSON file."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, MISSING
import json
from pathlib import Path
from typing import Any, Self

from active_recon.errors import WeightsError
from active_recon.json_text import json_value
from active_recon.quality.features import FEATURES
from active_recon.quality.latents import KnownLatents
from active_recon.quality.quality import SUSPECTS
from active_recon.whole_files import whole_file
import numpy as np


@dataclass(frozen=True)
class Heads:
    """
    What `active-recon quality fit` fits to a network's reconstructions.

    F features, first those of `FEATURES`, then the latent's distance; K numbers of views, the last
    of which stands for all more; D pooled channels.

    - weights_sha256: of the network's weights
    - centre, scale: (F,), by which features are standardised
    - head: (2 F,), the weights of the standardised features and of their squares in the log odds
      of the IoU; intercepts: (K,)
    - latent_mean: (D,); latent_whitening: (D, D)
    - suspects: names of faults; fault_head: (faults, F + 1), their log odds against no fault
    """

    weights_sha256: str
    centre: Sequence[float]
    scale: Sequence[float]
    head: Sequence[float]
    intercepts: Sequence[float]
    latent_mean: Sequence[float]
    latent_whitening: Sequence[Sequence[float]]
    suspects: Sequence[str]
    fault_head: Sequence[Sequence[float]]

    @property
    def known_latents(self) -> KnownLatents:
        """The latents of the training objects."""
        return KnownLatents(np.array(self.latent_mean), np.array(self.latent_whitening))


@dataclass(frozen=True)
class QualityTables(Heads):
    """
    What is fitted, and what is calibrated on objects that nothing was fitted to; plain numbers.

    K numbers of views as those of `Heads`; P targets.

    - margin: (K,), between expected IoU and lower bound
    - targets: (P,), increasing, that can be promised; needed: (P,), the expected IoU for that in
      any order of the views; needed_learned: (P,), the same where the learned policy of the
      weights chooses them on a turntable, empty where that was not measured
    - growth: (K,), between expected and attainable IoU
    - usual_scores: (K, ...), increasing: the scores of usual views of a turntable, which are the
      log odds of any fault; usual_distances: (K, ...), those of the latent's distance
    - usual_scores_any, usual_distances_any: the same of views of no turntable; empty where none
      were measured
    """

    margin: Sequence[float]
    targets: Sequence[float]
    needed: Sequence[float]
    growth: Sequence[float]
    usual_scores: Sequence[Sequence[float]]
    usual_distances: Sequence[Sequence[float]]
    needed_learned: Sequence[float] = field(default_factory=list)
    usual_scores_any: Sequence[Sequence[float]] = field(default_factory=list)
    usual_distances_any: Sequence[Sequence[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Raise WeightsError where shapes do not fit each other, or names are unknown."""
        size, counts, width = len(FEATURES) + 1, len(self.margin), len(self.latent_mean)
        expected = {
            'centre': (size,), 'scale': (size,), 'head': (2 * size,), 'intercepts': (counts,),
            'growth': (counts,), 'needed': (len(self.targets),),
            'needed_learned': (len(self.targets),) if len(self.needed_learned) else (0,),
            'latent_whitening': (width, width), 'fault_head': (len(self.suspects), size + 1)}
        for name, shape in expected.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise WeightsError(f'quality tables: {name} of a wrong shape: expected {shape}, '
                                   f'got {found}')
        rows = {len(self.usual_scores), len(self.usual_distances)}
        of_any = {len(self.usual_scores_any), len(self.usual_distances_any)}
        if not counts or rows != {counts} or of_any not in ({0}, {counts}):
            raise WeightsError('quality tables: no usual scores for some numbers of views: '
                               f'expected those of {counts}, got {min(rows | of_any)}')
        if unknown := set(self.suspects) - SUSPECTS.keys():
            raise WeightsError('quality tables: unknown suspects: expected some of '
                               f'{", ".join(SUSPECTS)}, got {", ".join(sorted(unknown))}')

    def needed_where(self, learned: bool) -> Sequence[float]:
        """Return what targets need, (P,), where the learned policy goes around or not."""
        return self.needed_learned if learned and len(self.needed_learned) else self.needed

    def most_promised(self, learned: bool) -> float:
        """Return the largest target that an expected IoU up to 1 is enough for, 0 if none is."""
        return max((target for target, needed in zip(
            self.targets, self.needed_where(learned), strict=True) if needed <= 1), default=0.0)

    def usual(self, around: bool) -> tuple[Sequence[Sequence[float]], Sequence[Sequence[float]]]:
        """Return usual scores and distances, (K, ...), of views of a turntable or of others."""
        if around or not len(self.usual_scores_any):
            return self.usual_scores, self.usual_distances
        return self.usual_scores_any, self.usual_distances_any

    @property
    def fewest_usual(self) -> int:
        """The least number of usual views that others are compared with."""
        return min(map(len, (*self.usual_scores, *self.usual_scores_any)))

    def write(self, path: Path, **notes: Any) -> None:
        """Write the tables, and notes on how they were made, as JSON, whole or not at all."""
        with whole_file(path) as unfinished:
            unfinished.write_text(json.dumps({**asdict(self), **notes}) + '\n')

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read tables; raises WeightsError where they cannot be used."""
        try:
            found = json_value(path.read_text())
            return cls(**{each.name: found[each.name] for each in fields(cls)
                          if each.name in found or each.default_factory is MISSING})
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise WeightsError(f'{path}: no readable quality tables: expected those that '
                               f'`active-recon quality fit` writes, got: {error!r}') from error


def tables_path(weights: Path) -> Path:
    """Return the file beside weights that their quality tables are in."""
    return weights.with_name(f'{weights.stem}-quality.json')


def find_tables(weights: Path, sha256: str) -> tuple[QualityTables | None, str]:
    """Return the tables beside weights of a SHA-256, None where there are none, and why."""
    path = tables_path(weights)
    if not path.is_file():
        return None, f'no quality: expected its tables in {path.name}, beside the weights'
    tables = QualityTables.read(path)
    if tables.weights_sha256 != sha256:
        return None, (f'no quality: {path.name} is of other weights: expected SHA-256 '
                      f'{sha256[:12]}, got {tables.weights_sha256[:12]}')
    return tables, ''


def needed_tables(weights: Path, sha256: str) -> QualityTables:
    """Return the tables as `find_tables`; raises WeightsError where there are none."""
    tables, why = find_tables(weights, sha256)
    if tables is None:
        raise WeightsError(f'{weights}: {why}')
    return tables
