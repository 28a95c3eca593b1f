"""Objects for a training that are made in memory: which ones, seen by which cameras."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
import math
from pathlib import Path

from active_recon.config import Config
from active_recon.datasets.cropped import cropped, cropped_camera
from active_recon.datasets.drawn_cameras import KINDS, Viewing
from active_recon.datasets.making import Job, rendered, shape_jobs, yawed
from active_recon.datasets.seeds import FIRST_SEEDS, SEEDS
from active_recon.errors import ActiveReconError, ConfigError, DataError
from active_recon.geometry.canonical import NetworkSpec
from active_recon.shapes import CATEGORIES, THINGS
from active_recon.volumes.meshes import fit_to_grid
from active_recon.volumes.voxelisation import voxelise
import numpy as np
from numpy.typing import NDArray
import trimesh

PARAMETRIC, THING, MESH = SOURCES = ('parametric', 'thing', 'mesh')
ROOT = Path('made')
"""The folder of objects that lie in none."""
_ATTEMPTS = 10
_STRETCHED, _MOST_STRETCH = 0.5, 4 / 3  # share of the mesh files, and factor along an axis


@dataclass(frozen=True)
class Recipe(Config):
    """
    Which objects are made, and from where they are seen.

    - sources: shares of 'parametric' (the categories that are trained on), 'thing' and 'mesh'
      (files of meshes, half of them stretched along their axes by up to a third)
    - cameras: shares of the kinds of cameras, see `Viewing`; half of the objects are turned
    - views: images of each object, of a turntable's or a dome's cameras a random part
    - samples: N x N rays a pixel
    - seed: of all that is drawn

    Raises ConfigError on unknown names, on shares below 0 or without a sum, on other numbers
    below 1 and on more views than a turntable has.
    """

    sources: Mapping[str, float] = field(
        default_factory=lambda: {PARAMETRIC: 0.34, THING: 0.25, MESH: 0.41})
    cameras: Mapping[str, float] = field(
        default_factory=lambda: {'any': 0.61, 'turntable': 0.33, 'dome': 0.06})
    views: int = 12
    samples: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Reject what cannot be made."""
        for name, shares, known in (('sources', self.sources, SOURCES),
                                    ('cameras', self.cameras, KINDS)):
            if not set(shares) <= set(known) or min(shares.values(), default=0) < 0 or not (
                    0 < sum(shares.values()) < math.inf):
                raise ConfigError(f'{name}: invalid shares: expected numbers of 0 or more, not '
                                  f'all 0, for {", ".join(known)}, got {dict(shares)}')
        if not 1 <= self.views <= 24 or min(self.samples, self.seed + 1) < 1:
            raise ConfigError('Recipe: number out of range: expected 1 to 24 views, 1 or more '
                              f'samples and a seed of 0 or more, got {self.to_dict()}')


@dataclass(frozen=True, eq=False)
class Made:
    """
    One object, of V views; see `ViewSet` for the arrays, which are those of one row.

    `left_out` tells of objects that were to be made instead, and could not be: their categories
    and names, and why.
    """

    category: str
    name: str
    images: NDArray[np.uint8]
    seen: NDArray[np.bool_]
    poses: NDArray[np.float64]
    intrinsics: NDArray[np.float64]
    voxels: NDArray[np.bool_]
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Maker:
    """Makes the objects of a recipe for a network; `meshes` are the jobs of mesh files."""

    recipe: Recipe
    meshes: tuple[Job, ...]
    spec: NetworkSpec

    def __post_init__(self) -> None:
        """Reject a recipe without its meshes, and a network of other images."""
        if self.recipe.sources.get(MESH, 0) > 0 and not self.meshes:
            raise ConfigError('sources: a share of meshes and no meshes: expected at least one '
                              'mesh file, or a share of 0')
        if self.spec.needs_front:
            raise ConfigError('objects made while training: expected a network that accepts any '
                              'camera, such as lifting; this one needs the 24 views of a '
                              'turntable: make them by `dataset build`')

    def __call__(self, index: int) -> Made:
        """
        Return the object of a number, which depends on that and on the recipe alone.

        One that cannot be made is replaced by the next that is drawn, and told. Raises DataError
        where ten in a row cannot be made.
        """
        left_out: list[str] = []
        for attempt in range(_ATTEMPTS):
            job, viewing, rng = self.drawn(index, attempt)
            try:
                return replace(self._made(job, viewing, rng), left_out=tuple(left_out))
            except (ActiveReconError, OSError) as error:
                name = job.folder.name.removesuffix(f'-{index}')
                left_out.append(f'{job.folder.category}/{name}: {error}')
        raise DataError(f'{_ATTEMPTS} objects in a row cannot be made:'
                        + ''.join(f'\n  {reason}' for reason in dict.fromkeys(left_out)))

    def drawn(self, index: int, attempt: int) -> tuple[Job, Viewing, np.random.Generator]:
        """
        Return what is to be made at an attempt, its cameras, and the generator of the rest.

        The objects are of the seeds and the categories that are trained on.
        """
        rng = np.random.default_rng([self.recipe.seed, index, attempt])
        source, cameras = _one_of(self.recipe.sources, rng), _one_of(self.recipe.cameras, rng)
        viewing = Viewing(cameras, self.recipe.views, turned=True)
        if source == MESH:
            job = self.meshes[rng.integers(len(self.meshes))]
            # Another name each time: cameras and yaw are drawn by it
            folder = replace(job.folder, root=ROOT, name=f'{job.folder.name}-{index}')
            return Job(folder, _stretched(job.make_mesh, rng)), viewing, rng
        category = str(rng.choice(CATEGORIES if source == PARAMETRIC else THINGS))
        seed = FIRST_SEEDS['train'] + int(rng.integers(SEEDS))
        return shape_jobs(category, [seed], ROOT)[0], viewing, rng

    def _made(self, job: Job, viewing: Viewing, rng: np.random.Generator) -> Made:
        name, size = job.folder.full_name, self.spec.image_size
        mesh, yaw = job.make_mesh(), viewing.yaw(name)
        if yaw:
            mesh = yawed(mesh, yaw)
        cameras, lights = viewing.of(name)
        chosen = np.sort(rng.permutation(len(cameras))[:self.recipe.views])
        cameras, lights = [cameras[view] for view in chosen], [lights[view] for view in chosen]
        images = rendered(mesh, cameras, lights, self.recipe.samples)
        grid = voxelise(mesh, self.spec.resolution)
        pictures, seen = zip(*(cropped(image, camera, grid.size, size)
                               for image, camera in zip(images, cameras, strict=True)),
                             strict=True)
        views = [cropped_camera(camera, grid.size, size) for camera in cameras]
        return Made(job.folder.category, job.folder.name, np.stack(pictures), np.stack(seen),
                    np.stack([view.pose for view in views]),
                    np.stack([view.intrinsics.matrix for view in views]), grid.occupied(0.5))


def _one_of(shares: Mapping[str, float], rng: np.random.Generator) -> str:
    weights = np.array(list(shares.values()))
    return str(rng.choice(list(shares), p=weights / weights.sum()))


def _stretched(make_mesh: Callable[[], trimesh.Trimesh],
               rng: np.random.Generator) -> Callable[[], trimesh.Trimesh]:
    """Return what makes the same mesh, or in half of the cases one stretched along its axes."""
    stretches, factors = rng.random() < _STRETCHED, _MOST_STRETCH ** rng.uniform(-1, 1, 3)

    def make() -> trimesh.Trimesh:
        mesh = make_mesh().copy()
        mesh.apply_transform(np.diag([*factors, 1.0]))
        return fit_to_grid(mesh)

    return make if stretches else make_mesh
