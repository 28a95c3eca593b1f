"""What `train --make` means: objects that are made while a network learns from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.datasets.layout import ObjectFolder
    from active_recon.datasets.making import Job
    from active_recon.geometry.canonical import NetworkSpec
    from active_recon.training.loop import TrainingConfig
    from active_recon.training.made_objects import MadeObjects

_FIRST_BATCHES = 8  # of different objects, before the first step

MakeProcesses = Annotated[int | None, typer.Option(
    '--make', min=1, metavar='PROCESSES',
    help='Without DATA: make the objects during the training, in so many processes of one thread: '
         'parametric objects, things, and of --meshes; each is drawn some times, then a new one '
         'takes its place. For networks that accept any camera.')]
Meshes = Annotated[Path | None, typer.Option(
    help='With --make: mesh files, a folder <category>/<mesh>, or a manifest (CSV), of which the '
         'rows of split train with explicit open licences are taken. Half of them are stretched '
         'along their axes by up to a third.')]
MadeOf = Annotated[str | None, typer.Option(
    help="With --make: shares of the objects' sources. Default: "
         'parametric=0.34,thing=0.25,mesh=0.41, without --meshes the first two of them.')]
MadeCameras = Annotated[str | None, typer.Option(
    help='With --make: shares of the cameras that the objects are seen by, see `dataset build`. '
         'Default: any=0.61,turntable=0.33,dome=0.06.')]
Uses = Annotated[float, typer.Option(
    help='With --make: how many times an object is drawn, on average. With more, fewer have to be '
         'made.')]
Kept = Annotated[int, typer.Option(
    min=1, help='With --make: objects in memory, 1.2 MB each; the oldest is dropped for a new '
                'one.')]


@dataclass(frozen=True)
class MadeOptions:
    """The options of `train --make`, as they are given."""

    processes: int
    meshes: Path | None
    sources: str | None
    cameras: str | None
    uses: float
    kept: int

    def __post_init__(self) -> None:
        """Reject what goes with --make and is given without."""
        if not self.processes and (self.meshes or self.sources or self.cameras):
            raise ConfigError('--meshes, --made-of and --made-cameras need --make: give it too')
        if not self.uses > 0:
            raise ConfigError(f'--uses: expected a number above 0, got {self.uses:g}')

    def objects(self, spec: 'NetworkSpec', training: 'TrainingConfig', rank: int,
                world: int) -> 'MadeObjects':
        """
        Return the objects, to be made, that a network learns from.

        Each of `world` processes that train gets its share. Raises ConfigError on options that
        make nothing, DataError on meshes that are none.
        """
        from active_recon.datasets.recipes import Maker, MESH, Recipe
        from active_recon.training.made_objects import MadeObjects, Pace

        recipe = Recipe(seed=training.seed)
        if self.sources:
            recipe = replace(recipe, sources=_shares('--made-of', self.sources))
        elif self.meshes is None:
            recipe = replace(recipe, sources={name: share for name, share
                                              in recipe.sources.items() if name != MESH})
        if self.meshes and not recipe.sources.get(MESH):
            raise ConfigError('--meshes: no effect: expected a share of mesh in --made-of, got '
                              f'{self.sources}')
        if self.cameras:
            recipe = replace(recipe, cameras=_shares('--made-cameras', self.cameras))
        batch = training.batch_size // world
        kept = max(self.kept // world, batch)
        pace = Pace(min(_FIRST_BATCHES * batch, kept), batch / self.uses, kept)
        jobs = tuple(_jobs(self.meshes)) if self.meshes else ()
        return MadeObjects(Maker(recipe, jobs, spec), pace, max(1, self.processes // world), rank,
                           world, lambda reason: typer.echo(f'left out: {reason}', err=True))


def make_first(objects: 'MadeObjects', checkpoint: Path | None) -> None:
    """Make what the next step draws from, that after a checkpoint, behind a progress bar."""
    from active_recon.training.checkpoints import step_reached

    step = step_reached(checkpoint) if checkpoint else 0
    with progress_bar('making the first objects', objects.lacking(step)) as advance:
        objects.at(step, lambda: advance(1, ''))


def warn_of_meshes(objects: 'MadeObjects', held_out: 'Sequence[ObjectFolder]') -> None:
    """Warn where validation objects have the names of meshes that are trained on."""
    trained = set(objects.meshes)
    shared = sum(folder.full_name in trained for folder in held_out)
    if shared:
        typer.echo(f'warning: {shared} of {len(held_out)} validation objects have the names of '
                   'meshes that are trained on: if they are the same, the threshold is biased, '
                   'and their IoU is too high', err=True)


def making_told(objects: 'MadeObjects') -> str:
    """Return in words how many objects were made, and whether more processes would be faster."""
    return (f'{objects.made} objects made; the steps waited {objects.waited:.0f} s for them, the '
            'first included')


def _jobs(meshes: Path) -> 'list[Job]':
    from active_recon.datasets.making import mesh_jobs
    from active_recon.datasets.manifest import manifest_jobs, read_manifest
    from active_recon.datasets.recipes import ROOT
    from active_recon.errors import DataError

    if meshes.suffix != '.csv':
        return mesh_jobs(meshes, ROOT, None, None)
    rows = [row for row in read_manifest(meshes) if row.split == 'train' and row.is_open]
    if not rows:
        raise DataError(f'{meshes}: nothing to train on: expected rows of split train whose '
                        'licence is explicit for the models and open, got none')
    return manifest_jobs(rows, ROOT)


def _shares(option: str, text: str) -> Mapping[str, float]:
    try:
        pairs = [part.split('=') for part in text.split(',')]
        return {name.strip(): float(share) for name, share in pairs}
    except ValueError as error:
        raise ConfigError(f'{option}: no shares: expected such as any=0.7,turntable=0.3, got '
                          f'{text!r}') from error
