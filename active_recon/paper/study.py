"""The settings that all parts share: data, models, and parameters of the measurements."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
import hashlib
from pathlib import Path
import shlex
from typing import Any

from active_recon.cluster import Crew
from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.datasets.splits import SYNSETS
from active_recon.datasets.views import read_views, ViewSet
from active_recon.errors import DataError, WeightsError
from active_recon.models.weights_files import find_weights, PAPER_MODEL
from active_recon.reporting import Reporting, silent
from active_recon.runtimes.precision import has_bf16
from active_recon.volumes.voxels import RESOLUTION

SAMPLES = 75_000
REAL = {'real_val': 'real models, `val`', 'real_cc0': 'real models that ship (CC0)',
        'real_unseen': 'real models of unseen categories'}
"""Folders of rendered real models, which are measured if they exist, and their titles."""


@dataclass(frozen=True)
class Objects:
    """Objects of a dataset on disk, of one category or of all (''), and a voxel resolution."""

    root: Path
    category: str = ''
    resolution: int = RESOLUTION

    def folders(self) -> list[ObjectFolder]:
        """Return the objects' folders; raises DataError where there is none."""
        folders = [folder for folder in list_objects(self.root)
                   if self.category in ('', SYNSETS.get(folder.category, folder.category))]
        if not folders:
            raise DataError(f'{self.root}: no such objects: expected those of the category '
                            f'{self.category}, found none; `active-recon dataset build` makes '
                            'them')
        return folders

    def elsewhere(self) -> 'Objects':
        """Return the objects as a worker takes them, which begins in a folder of its own."""
        return replace(self, root=self.root.absolute())

    @property
    def present(self) -> bool:
        """Whether there is any object with voxels of this resolution."""
        return any(folder.voxels_path(self.resolution).is_file()
                   for folder in (list_objects(self.root) if self.root.is_dir() else ()))

    def identity(self) -> dict[str, Any]:
        """Return the folder, the number of objects and the hash of their names and voxels."""
        digest, folders = hashlib.sha256(), self.folders()
        for folder in folders:
            digest.update(f'{folder.category}/{folder.name}'.encode() + b'\0')
            path = folder.voxels_path()
            digest.update(path.read_bytes() if path.is_file() else b'')
        return {'folder': str(self.root), 'objects': len(folders), 'sha256': digest.hexdigest()}


@dataclass(frozen=True)
class Study:
    """
    The folders of data, weights and results, and the settings of all measurements.

    - data: a folder with train, val, test and unseen, as `active-recon dataset build` makes it,
      and optionally folders of rendered real models (REAL)
    - models: folder of the trainings of the compared systems, and of cached measurements
    - out: folder of the results
    - model: weights of the paper's network for parts without a comparison; None: those that ship
    - pascal3d: folder of PASCAL3D+, for figure 7
    - training: the folders in `data` that all systems are trained on
    - samples: number of views that each system is trained on
    - starts: number of first views of each object, of 24; policy_starts: the same where policies
      are compared; seed: of the starts, the trainings and the random policy
    - device: device on which IoU is measured; table 4 and figure 10 always time a CPU
    - policy_seeds: number of trainings of the view policy, and of runs of random
    - subset_objects: number of objects on which every sequence of three views is measured
    - bfloat16: whether policies are compared in mixed precision; by default where this machine's
      processor has it
    - crew: the workers of a cluster that train and measure; None: this process
    """

    data: Path = Path('data')
    models: Path = Path('runs/paper')
    out: Path = Path('docs/results')
    model: str | None = None
    pascal3d: Path | None = None
    training: tuple[str, ...] = ('train',)
    samples: int = SAMPLES
    starts: int = 4
    seed: int = 0
    threads: int = 2
    policy_seeds: int = 5
    policy_starts: int = 24
    subset_objects: int = 60
    device: str = 'cpu'
    views: int = 5
    bfloat16: bool = field(default_factory=has_bf16)
    progress: Reporting = field(default=silent, compare=False)
    crew: Crew | None = field(default=None, compare=False)

    def elsewhere(self) -> 'Study':
        """Return the study as a worker takes it, which begins in a folder of its own."""
        model = self.model and str(find_weights(self.model).absolute())
        return replace(self, data=self.data.absolute(), models=self.models.absolute(),
                       out=self.out.absolute(), model=model, progress=silent, crew=None)

    def objects(self, name: str, category: str = '', resolution: int = RESOLUTION) -> Objects:
        """Return the objects of a folder of the data."""
        return Objects(self.data / name, category, resolution)

    def real(self) -> list[str]:
        """Return the names of the folders of real models that exist."""
        return [name for name in REAL if self.objects(name).present]

    @property
    def weights(self) -> Path:
        """Path of the weights of the paper's network; raises WeightsError if there are none."""
        path = find_weights(self.model or PAPER_MODEL)
        if not path.is_file():
            raise WeightsError(f"{path}: no such file: expected weights of the paper's network; "
                               'give them by --model, or train them with `active-recon train`')
        return path

    def command(self, part: str) -> str:
        """Return the command line that makes a part with these settings."""
        words = ['active-recon', 'paper', part]
        usual = Study()
        for option in ('data', 'models', 'out', 'model', 'pascal3d', 'samples', 'starts', 'seed',
                       'threads', 'policy_seeds', 'policy_starts', 'subset_objects', 'device'):
            if (value := getattr(self, option)) != getattr(usual, option):
                words += [f'--{option.replace("_", "-")}', str(value)]
        if self.training != usual.training:
            words += [word for name in self.training for word in ('--training', name)]
        return shlex.join(words)

    def training_sets(self, category: str = '', resolution: int = RESOLUTION) -> list[Objects]:
        """Return the objects that the systems are trained on."""
        return [self.objects(name, category, resolution) for name in self.training]

    def read(self, *sets: Objects) -> ViewSet:
        """Read sets of objects as one; the last two results are cached in memory."""
        return _read(sets, self)

    def generators(self) -> str | None:
        """Return the hash of the generators that made the data, None where it is unknown."""
        path = self.data / 'generators.sha256'
        return path.read_text().strip() if path.is_file() else None


@lru_cache(maxsize=2)
def _read(sets: tuple[Objects, ...], study: Study) -> ViewSet:
    folders = [folder for objects in sets for folder in objects.folders()]
    title = ', '.join(str(objects.root) for objects in sets)
    with study.progress(f'reading {title}', len(folders)) as advance:
        return read_views(folders, lambda: advance(1, ''), sets[0].resolution)
