"""`active-recon render` and `active-recon dataset build`: meshes and shapes to datasets."""

import os
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError, DataError
import typer

if TYPE_CHECKING:
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import Job

Workers = Annotated[int, typer.Option(min=1, help='Processes; default: one for each core.')]
Samples = Annotated[int, typer.Option(
    min=1, max=4, help='Rays in each pixel, N x N: 1 is flat and fast, 2 smooths the edges.')]

Fine = Annotated[bool, typer.Option(
    '--fine', help='Voxelise with 64 cells a side too; what is there gets just these.')]
Cameras = Annotated[str, typer.Option(
    help="'turntable' (24 azimuths, elevation 30 degrees) or 'any': drawn for each object, "
         'elevation -10 to 85 degrees, any distance and lens, images of 160 pixels.')]
Views = Annotated[int, typer.Option(
    min=1, max=99, help="Views of each object, where its cameras are drawn ('any').")]
Turned = Annotated[bool, typer.Option(
    '--turned', help='Every other object stands at any yaw, not with its front at +x.')]

dataset = typer.Typer(help='Datasets that nothing needs to be downloaded for.',
                      no_args_is_help=True)

_CORES = os.cpu_count() or 1
_SEEDS = 1_000_000  # for each split
_SPLIT_SEEDS = {'train': 0, 'val': _SEEDS, 'test': 2 * _SEEDS, 'unseen': 3 * _SEEDS}


def render(
    meshes: Annotated[Path, typer.Argument(
        help='A mesh file, a folder of <category>/<mesh>, or a manifest (CSV).')],
    out: Annotated[Path, typer.Argument(help='Where the dataset goes.')],
    up: Annotated[str | None, typer.Option(
        help='The axis that points up in the files: x, y, z, or with a sign. glTF and GLB are y '
             'by their standard, others are taken as z.')] = None,
    front: Annotated[str | None, typer.Option(
        help="The axis of the objects' front; glTF and GLB: z, others: x.")] = None,
    split: Annotated[str | None, typer.Option(
        help='Of a manifest: only the rows of this split.')] = None,
    explicit_licence: Annotated[bool, typer.Option(
        help='Of a manifest: only rows whose licence is explicit for the models and CC0, CC-BY or '
             'public domain.')] = False,
    samples: Samples = 2,
    fine: Fine = False,
    cameras: Cameras = 'turntable',
    views: Views = 12,
    turned: Turned = False,
    workers: Workers = _CORES,
) -> None:
    """
    Render meshes from their cameras and voxelise them, into R2N2's layout.

    Any format that trimesh reads will do. A run that was broken off goes on where it stopped: what
    is there is not made again. What could not be read is listed at the end, with the reason.
    """
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import mesh_jobs
    from active_recon.datasets.manifest import manifest_jobs, read_manifest

    viewing = Viewing(cameras, views, turned)
    if meshes.suffix == '.csv':
        if up or front:
            raise ConfigError('--up or --front with a manifest: expected neither, since it tells '
                              'them for each model')
        rows = [row for row in read_manifest(meshes)
                if split in (None, row.split)
                and (row.is_open or not explicit_licence)]
        jobs = manifest_jobs(rows, out)
    elif split or explicit_licence:
        raise ConfigError('no manifest: expected a manifest (CSV) with --split or '
                          f'--explicit-licence, got {meshes}')
    else:
        jobs = mesh_jobs(meshes, out, up, front)
    _make('rendering', jobs, samples, workers, fine, viewing)


@dataset.command()
def build(
    out: Annotated[Path, typer.Argument(help='Folder for train/, val/, test/ and unseen/.')],
    train: Annotated[int, typer.Option(
        min=0, max=_SEEDS, help='Training objects in each category.')] = 400,
    val: Annotated[int, typer.Option(
        min=0, max=_SEEDS, help='Validation objects in each category.')] = 50,
    test: Annotated[int, typer.Option(
        min=0, max=_SEEDS, help='Test objects in each category.')] = 100,
    unseen: Annotated[int, typer.Option(
        min=0, max=_SEEDS, help='Objects in each category that is never trained on.')] = 100,
    category: Annotated[list[str] | None, typer.Option(
        help='Only these categories (may be given several times).')] = None,
    samples: Samples = 2,
    fine: Fine = False,
    cameras: Cameras = 'turntable',
    views: Views = 12,
    turned: Turned = False,
    workers: Workers = _CORES,
) -> None:
    """
    Make a dataset of parametric shapes, so that nothing needs a download.

    Each object is drawn from a seed of its own, so the same numbers give the same objects; the
    splits' seeds never meet. The categories that are never trained on stand apart, in unseen/.
    The hash of the generators' code is written beside. A run that was broken off goes on where it
    stopped.
    """
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import shape_jobs
    from active_recon.shapes import ALL_CATEGORIES, generators_hash, UNSEEN_CATEGORIES

    counts = {'train': train, 'val': val, 'test': test, 'unseen': unseen}
    jobs = [job for name in dict.fromkeys(category or ALL_CATEGORIES)
            for split, count in counts.items()
            if (split == 'unseen') == (name in UNSEEN_CATEGORIES)
            for job in shape_jobs(name, range(_SPLIT_SEEDS[split], _SPLIT_SEEDS[split] + count),
                                  out / split)]
    made_by, code = out / 'generators.sha256', generators_hash()
    if made_by.is_file() and made_by.read_text().strip() != code:
        raise DataError(f'{out}: shapes of other generators: expected those of the present ones '
                        f'({code[:12]}), got what others made ({made_by}); choose another folder')
    out.mkdir(parents=True, exist_ok=True)
    made_by.write_text(code + '\n')
    _make('making', jobs, samples, workers, fine, Viewing(cameras, views, turned))


def _make(title: str, jobs: 'list[Job]', samples: int, workers: int, fine: bool,
          viewing: 'Viewing') -> None:
    from active_recon.datasets.making import make_dataset

    if not jobs:
        raise DataError('no objects to make: expected some, but what was asked for leaves none')
    refused = []
    with progress_bar(title, len(jobs)) as advance:
        for outcome in make_dataset(jobs, samples, workers, fine, viewing):
            if outcome.refusal:
                refused.append(outcome)
            advance(1, f'{len(refused)} refused' if refused else '')
    typer.echo(f'{len(jobs) - len(refused)} objects of {len(jobs)} are there')
    for outcome in refused:
        typer.echo(f'refused: {outcome.folder.category}/{outcome.folder.name}: '
                   f'{outcome.refusal}', err=True)
    if refused and len(refused) == len(jobs):
        raise typer.Exit(2)
