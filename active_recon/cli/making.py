"""`active-recon render` and `active-recon dataset build`: make datasets of meshes or shapes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.cluster_option import Cluster, reachable, Workers, workers_of
from active_recon.cli.needed_options import refuse_idle, refuse_lone
from active_recon.cli.progress import progress_bar
from active_recon.datasets.seeds import FIRST_SEEDS, SEEDS
from active_recon.errors import ConfigError, DataError
from active_recon.whole_files import whole_file, writable_folder
import typer

if TYPE_CHECKING:
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import Job

Samples = Annotated[int, typer.Option(
    min=1, max=4, help='N x N rays per pixel: 1 is fastest, 2 smooths the edges.')]

Fine = Annotated[bool, typer.Option(
    '--fine', help='Also voxelise at 64 cells a side; finished objects get only these voxels.')]
Depth = Annotated[bool, typer.Option(
    '--depth', help='Also write a depth image beside each image, without noise; finished objects '
                    'get only these.')]
Cameras = Annotated[str, typer.Option(
    help="'turntable' (24 azimuths, elevation 30 degrees), 'dome' (12 azimuths at elevations of "
         "10, 30, 50 and 70 degrees) or 'any' (random for each object: elevation -10 to 85 "
         'degrees, any distance and lens; images of 160 pixels).')]
Views = Annotated[int, typer.Option(
    min=1, max=99, help='Number of views of each object, with --cameras any.')]
Turned = Annotated[bool, typer.Option(
    '--turned', help='Give half of the objects a random yaw, instead of their front at +x.')]

_ANY = '--cameras any'

dataset = typer.Typer(help='Datasets of parametric shapes, made without any download.',
                      no_args_is_help=True)


def render(
    context: typer.Context,
    meshes: Annotated[Path, typer.Argument(
        help='A mesh file, a folder of <category>/<mesh>, or a manifest (CSV).')],
    out: Annotated[Path, typer.Argument(help='Folder of the dataset.')],
    up: Annotated[str | None, typer.Option(
        help='Axis of the mesh files that points up: x, y, z, with or without a sign. Default: '
             'y for glTF and GLB, z for others.')] = None,
    front: Annotated[str | None, typer.Option(
        help="Axis of the mesh files that points to the object's front. Default: z for glTF and "
             'GLB, x for others.')] = None,
    split: Annotated[str | None, typer.Option(
        help='With a manifest: only the rows of this split.')] = None,
    explicit_licence: Annotated[bool, typer.Option(
        help='With a manifest: only rows whose licence is explicit for the models and is CC0, '
             'CC-BY or public domain.')] = False,
    samples: Samples = 2,
    fine: Fine = False,
    depth: Depth = False,
    cameras: Cameras = 'turntable',
    views: Views = 12,
    turned: Turned = False,
    workers: Workers = None,
    cluster: Cluster = None,
) -> None:
    """
    Render and voxelise meshes, as a dataset in R2N2's layout.

    Reads every format of trimesh. An interrupted run continues where it stopped: finished objects
    are kept. Meshes that cannot be used are listed at the end, with the reason; where all are
    such, the exit code is 2.
    """
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import mesh_jobs
    from active_recon.datasets.manifest import manifest_jobs, read_manifest

    viewing = Viewing(cameras, views, turned)
    refuse_lone(context, _ANY, cameras == 'any', 'views')
    meshes, out = reachable(meshes, cluster), reachable(out, cluster)
    if meshes.suffix == '.csv':
        if up or front:
            raise ConfigError('--up or --front with a manifest: expected neither, since the '
                              'manifest has the axes of each model')
        rows = [row for row in read_manifest(meshes)
                if split in (None, row.split)
                and (row.is_open or not explicit_licence)]
        jobs = manifest_jobs(rows, out)
    elif split or explicit_licence:
        raise ConfigError('no manifest: expected a manifest (CSV) with --split or '
                          f'--explicit-licence, got {meshes}')
    else:
        jobs = mesh_jobs(meshes, out, up, front)
    _require_work(jobs, out)
    _make('rendering', jobs, samples, fine, viewing, depth, workers, cluster, [meshes])


@dataset.command()
def build(
    context: typer.Context,
    out: Annotated[Path, typer.Argument(help='Folder for train/, val/, test/ and unseen/.')],
    train: Annotated[int, typer.Option(
        min=0, max=SEEDS, help='Training objects per category.')] = 400,
    val: Annotated[int, typer.Option(
        min=0, max=SEEDS, help='Validation objects per category.')] = 50,
    test: Annotated[int, typer.Option(
        min=0, max=SEEDS, help='Test objects per category.')] = 100,
    unseen: Annotated[int, typer.Option(
        min=0, max=SEEDS, help='Objects per held-out category.')] = 100,
    category: Annotated[list[str] | None, typer.Option(
        help='Only these categories (may be given several times).')] = None,
    samples: Samples = 2,
    fine: Fine = False,
    depth: Depth = False,
    cameras: Cameras = 'turntable',
    views: Views = 12,
    turned: Turned = False,
    workers: Workers = None,
    cluster: Cluster = None,
) -> None:
    """
    Make a dataset of parametric shapes.

    Each object has its own seed, so the same options give the same objects, and no object is in
    two splits. The held-out categories, which are never trained on, are in unseen/. The hash of
    the generators' code is written to generators.sha256. An interrupted run continues where it
    stopped. Objects that cannot be made are listed at the end, with the reason; where all are
    such, the exit code is 2.
    """
    from active_recon.datasets.drawn_cameras import Viewing
    from active_recon.datasets.making import shape_jobs
    from active_recon.shapes import ALL_CATEGORIES, generators_hash, UNSEEN_CATEGORIES

    viewing = Viewing(cameras, views, turned)
    refuse_lone(context, _ANY, cameras == 'any', 'views')
    out = reachable(out, cluster)
    counts = {'train': train, 'val': val, 'test': test, 'unseen': unseen}
    categories = tuple(dict.fromkeys(category or ALL_CATEGORIES))
    made_in = {split: [name for name in categories
                       if (split == 'unseen') == (name in UNSEEN_CATEGORIES)] for split in counts}
    jobs = [job for name in categories
            for split, count in counts.items() if name in made_in[split]
            for job in shape_jobs(name, range(FIRST_SEEDS[split], FIRST_SEEDS[split] + count),
                                  out / split)]
    for split, count in counts.items():
        others = f'with categories that are never in {split}/: {", ".join(categories)}'
        refuse_idle(context, others, count > 0 and not made_in[split], split)
    _require_work(jobs, out)
    made_by, code = out / 'generators.sha256', generators_hash()
    if not made_by.is_file():
        with whole_file(made_by) as unfinished:
            unfinished.write_text(code + '\n')
    elif made_by.read_text().strip() != code:
        raise DataError(f'{out}: shapes of other generators: expected those of the present code '
                        f'({code[:12]}), got another hash in {made_by}; choose another folder')
    _make('making', jobs, samples, fine, viewing, depth, workers, cluster)


def _require_work(jobs: 'list[Job]', out: Path) -> None:
    """Raise DataError where there is nothing to make, ConfigError where nothing can be written."""
    if not jobs:
        raise DataError('no objects to make: expected at least one, got none with these options')
    writable_folder(out)  # else each object is refused, once it is rendered


def _make(title: str, jobs: 'list[Job]', samples: int, fine: bool, viewing: 'Viewing',
          depth: bool, workers: int | None, cluster: str | None,
          reads: Sequence[Path] = ()) -> None:
    from active_recon.cluster.telling import told
    from active_recon.datasets.making import make_dataset

    rejected, kept = [], 0
    with workers_of(cluster, workers) as crew, progress_bar(title, len(jobs)) as advance:
        outcomes = make_dataset(jobs, samples, 1, fine, viewing, depth, crew, reads)
        for outcome in told(outcomes, crew, advance):
            kept += outcome.kept
            if outcome.refusal:
                rejected.append(outcome)
    rejected.sort(key=lambda outcome: (outcome.folder.category, outcome.folder.name))
    before = f', {kept} of them finished before, kept as they are' if kept else ''
    typer.echo(f'{len(jobs) - len(rejected)} of {len(jobs)} objects made{before}')
    for outcome in rejected:
        typer.echo(f'rejected: {outcome.folder.full_name}: '
                   f'{outcome.refusal}', err=True)
    if rejected and len(rejected) == len(jobs):
        raise typer.Exit(2)
