"""`active-recon paper`: reproduces the paper's tables and figures."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.cluster_option import (
    Cluster,
    ClusterWorkers,
    require_cluster,
    require_path,
    workers_of,
)
from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
from active_recon.whole_files import writable
import typer

if TYPE_CHECKING:
    from active_recon.paper.study import Study

ALL, SYSTEMS, DOCUMENT = 'all', 'systems', 'document'


def paper(
    parts: Annotated[list[str], typer.Argument(
        metavar='PART...', help='table1 to table5, fig5 to fig11, policies, document, systems, '
                                'or all.')],
    data: Annotated[Path, typer.Option(
        help='Folder with train, val, test and unseen (made by `active-recon dataset build`). If '
             'it also has real_val, real_cc0 or real_unseen (made by `active-recon render`), '
             'they get their own rows.')] = Path('data'),
    models: Annotated[Path, typer.Option(
        help='Folder of the trainings of the compared systems, and of cached measurements.',
        )] = Path('runs/paper'),
    out: Annotated[Path, typer.Option(
        help='Folder for the Markdown, JSON and PNG files.')] = Path('docs/results'),
    model: Annotated[str | None, typer.Option(
        help="Weights (or the name of a model that ships) of the paper's network for the parts "
             'without a comparison: tables 4 and 5, figures 9 to 11, policies. Default: the '
             'weights that ship.',
        )] = None,
    pascal3d: Annotated[Path | None, typer.Option(
        help='Folder of PASCAL3D+, for figure 7; default: real models instead.')] = None,
    training: Annotated[list[str] | None, typer.Option(
        help='Folder in DATA that all systems are trained on (may be given several times); '
             'default: train.')] = None,
    samples: Annotated[int, typer.Option(
        min=1, help='Number of views that each system is trained on.')] = 75_000,
    starts: Annotated[int, typer.Option(
        min=1, max=24, help='Number of first views measured for each object, out of 24.')] = 4,
    policy_starts: Annotated[int, typer.Option(
        min=1, max=24, help='The same, where policies are compared.')] = 24,
    policy_seeds: Annotated[int, typer.Option(
        min=1, help='Number of trainings of the view policy and of runs of the policy '
                    'random.')] = 5,
    subset_objects: Annotated[int, typer.Option(
        min=0, help='Number of objects on which every sequence of three views is measured, '
                    '12,720 passes each; 0 skips this.')] = 60,
    seed: Annotated[int, typer.Option(
        min=0, help='Seed of the trainings, the starts and the random views.')] = 0,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    device: Annotated[str, typer.Option(
        help='Device on which IoU is measured, cpu or cuda. Trainings use a GPU if there is one; '
             'the times in table 4 and figure 10 are always of a CPU.')] = 'cpu',
    again: Annotated[bool, typer.Option(
        help='Make the parts again even if their inputs have not changed. Cached measurements in '
             'MODELS/measured are still used.')] = False,
    cluster: Cluster = None,
    workers: ClusterWorkers = None,
) -> None:
    """
    Reproduce the paper's tables and figures; write each as Markdown, JSON and PNG.

    Systems that a part compares are trained first if their weights are missing (`systems` does
    only that), on the same objects and the same number of views. Weights that ship are used
    instead if they were trained on about as many views. An interrupted run continues where it
    stopped, and a part whose data, weights and settings have not changed is not made again.
    `document` combines the existing parts in OUT/README.md, with conclusions; `all` makes
    everything.

    With --cluster, each training is an item of its own, and so is each block of episodes whose
    IoU is measured; times are measured by this process.

    Example: active-recon paper table1 --samples 20000 --out /tmp/results
    """
    from active_recon.datasets.pascal3d import require_pascal3d
    from active_recon.models.weights_files import weights_hash
    from active_recon.paper.parts import PARTS
    from active_recon.paper.study import Study
    import torch

    known = (*PARTS, DOCUMENT, SYSTEMS, ALL)
    if unknown := [part for part in parts if part not in known]:
        raise ConfigError(f'PART: unknown: expected some of {", ".join(known)}, got '
                          f'{", ".join(unknown)}')
    if device != 'cpu' and not (device == 'cuda' and torch.cuda.is_available()):
        raise ConfigError('--device: no such device: expected cpu, or cuda where there is a GPU, '
                          f'got {device}')
    require_cluster(cluster, workers)
    data, models, out = (require_path(folder) for folder in (data, models, out))
    if cluster and device != 'cpu':
        raise ConfigError(f'--cluster: expected --device cpu, got {device}')
    if pascal3d is not None:
        require_pascal3d(pascal3d)
    writable(out / 'README.md')
    torch.set_num_threads(threads)
    study = Study(data, models, out, model, pascal3d, tuple(training or ('train',)), samples,
                  starts, seed, threads, policy_seeds, policy_starts, subset_objects, device,
                  progress=progress_bar)
    weights_hash(study.weights)  # all of this is told before hours of training
    wanted = [*PARTS, DOCUMENT] if ALL in parts else list(dict.fromkeys(parts))
    try:
        with workers_of(cluster, workers) if cluster else nullcontext() as crew:
            for part in wanted:
                _do(replace(study, crew=crew), part, again)
    except KeyboardInterrupt:
        typer.echo('stopped; to continue run it again, without --again')
        raise typer.Exit(130) from None


def _do(study: 'Study', part: str, again: bool) -> None:
    from active_recon.paper.document import write_document
    from active_recon.paper.parts import run_part
    from active_recon.paper.systems import have_systems, systems

    if part == SYSTEMS:
        for system, weights in have_systems(study, systems(study)).items():
            typer.echo(f'{system.label}: {weights}')
    elif part == DOCUMENT:
        changed = write_document(study)
        typer.echo(f'{study.out / "README.md"}: {"written" if changed else "unchanged"}')
    else:
        made = run_part(study, part, again)
        typer.echo(f'{study.out / part}.md, .json, .png: {"written" if made else "unchanged"}')
