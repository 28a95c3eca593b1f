"""How photos are reconstructed."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.photos.backgrounds import BACKGROUNDS
import numpy as np

FRAMES = 36
"""Of a video, unless told: around an object one every ten degrees."""


@dataclass(frozen=True)
class Options:
    """
    How photos are reconstructed.

    - box: x, y, z of the centre and the side of the object's cube, in units of the camera file;
      None: as the file says, else found
    - unit: metres in a unit of the camera file; size: side of the cube in metres, which sets the
      scale instead, or the cube's own side where the cameras are in metres for certain
    - up: the axis of the file's world that points up (x, y, z, with or without a sign); None: as
      the format says, else the mean of what is up in the photos
    - axes: camera axes, one of LOOKS, instead of the format's
    - background: one of BACKGROUNDS; masks: a folder of masks, for `auto`
    - views: how many photos at even steps are used; None: all
    - order: of the photos, one of ORDERS
    - frames: how many of a video's are taken for photos
    - ground: whether the table under the object is searched in the photos
    - model: a model that ships by its name, or a weights file; threads: of the CPU

    Raises ConfigError on values that contradict each other.
    """

    box: Sequence[float] | None = None
    unit: float = 1.0
    size: float | None = None
    up: str | None = None
    axes: str | None = None
    background: str = 'auto'
    masks: Path | None = None
    views: int | None = None
    model: str | Path = DEFAULT_MODEL
    threads: int | None = 1
    order: str = 'name'
    ground: bool = True
    frames: int = FRAMES

    def __post_init__(self) -> None:
        """Reject what cannot be, before any photo is read."""
        if self.background not in BACKGROUNDS:
            raise ConfigError('background: unknown value: expected one of '
                              f'{", ".join(BACKGROUNDS)}, got {self.background!r}')
        if self.masks is not None and self.background != 'auto':
            raise ConfigError(f'masks with the background {self.background}: expected auto, which '
                              'alone uses masks; leave one of them out')
        for name, value, kind, expected in (
                ('unit', self.unit, Real, 'metres'), ('size', self.size, Real, 'metres'),
                ('views', self.views, Integral, 'a whole number'),
                ('frames', self.frames, Integral, 'a whole number'),
                ('threads', self.threads, Integral, 'a whole number')):
            if value is not None and not isinstance(value, kind):
                raise ConfigError(f'{name}: no number: expected {expected}, got {value!r}')
        for name, value in (('unit', self.unit), ('size', self.size)):
            if value is not None and not 0 < value < np.inf:
                raise ConfigError(f'{name}: out of range: expected metres above 0, got {value}')
        if self.box is not None and not (np.shape(self.box) == (4,) and all(
                isinstance(value, Real) for value in self.box)):
            raise ConfigError('box: expected four numbers, the centre x, y, z and the side, got '
                              f'{self.box!r}')
        for name, count in (('views', self.views), ('frames', self.frames)):
            if count is not None and count < 1:
                raise ConfigError(f'{name}: out of range: expected 1 or more, got {count}')
