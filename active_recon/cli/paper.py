"""`active-recon paper`: the paper's tables and figures, measured here."""

from pathlib import Path
from typing import Annotated

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

ALL, SYSTEMS, DOCUMENT = 'all', 'systems', 'document'


def paper(
    parts: Annotated[list[str], typer.Argument(
        metavar='PART...', help='table1 to table5, fig5 to fig11, policies, document, systems, '
                                'or all.')],
    data: Annotated[Path, typer.Option(
        help='Folder with train, val, test and unseen (`active-recon dataset build`); real_val, '
             'real_cc0 and real_unseen in it, as `active-recon render` makes them, get rows of '
             'their own.')] = Path('data'),
    models: Annotated[Path, typer.Option(
        help='Where the compared systems are trained, and what was measured of them is kept.',
        )] = Path('runs/paper'),
    out: Annotated[Path, typer.Option(
        help='Where Markdown, JSON and PNG go.')] = Path('docs/results'),
    model: Annotated[str | None, typer.Option(
        help="Weights (or the name of a model that ships) of the paper's network where nothing is "
             'compared: tables 4 and 5, figures 9 to 11, policies. Default: those that ship.',
        )] = None,
    pascal3d: Annotated[Path | None, typer.Option(
        help="PASCAL3D+'s folder, for figure 7; without it real models stand in.")] = None,
    training: Annotated[list[str] | None, typer.Option(
        help='Folder of DATA that all systems learn from (may be given several times); default: '
             'train.')] = None,
    samples: Annotated[int, typer.Option(
        min=1, help='Views that each system sees in training.')] = 75_000,
    starts: Annotated[int, typer.Option(
        min=1, max=24, help='First views of each object; 24 are all.')] = 4,
    policy_starts: Annotated[int, typer.Option(
        min=1, max=24, help='The same, where policies are compared.')] = 24,
    policy_seeds: Annotated[int, typer.Option(
        min=1, help='Trainings of the view policy, and draws of the random one.')] = 5,
    subset_objects: Annotated[int, typer.Option(
        min=0, help='Objects of which every sequence of three views is tried, 12,720 passes '
                    'each; 0 leaves that out.')] = 60,
    seed: Annotated[int, typer.Option(
        help='Of the trainings, of the starts, and of the random views.')] = 0,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    device: Annotated[str, typer.Option(
        help='Where IoU is measured, cpu or cuda. Trainings take a graphics card where there is '
             'one; table 4 and figure 10 always time a CPU.')] = 'cpu',
    again: Annotated[bool, typer.Option(
        help='Make the parts again, though what they are made from has not changed; what was '
             'measured of a network is taken from MODELS/measured.')] = False,
) -> None:
    """
    Measure the paper's tables and figures; write each as Markdown, JSON and PNG.

    Every system that a part compares is trained first where its weights are missing (`systems`
    does just that): on the same objects, on as many views. Weights that ship are taken instead of
    a training if they saw about as many. A run that was cut off goes on where it stopped, and a
    part whose data, weights and settings have not changed is not made again. `document` puts what
    is there together in OUT/README.md, with what follows from it; `all` makes everything.

    Example: `active-recon paper table1 --samples 20000 --out /tmp/results`
    """
    from active_recon.paper.document import write_document
    from active_recon.paper.parts import PARTS, run_part
    from active_recon.paper.study import Study
    from active_recon.paper.systems import have_systems, systems
    import torch

    known = (*PARTS, DOCUMENT, SYSTEMS, ALL)
    if unknown := [part for part in parts if part not in known]:
        raise ConfigError(f'no such parts: {", ".join(unknown)}; expected some of '
                          f'{", ".join(known)}')
    if device != 'cpu' and not (device == 'cuda' and torch.cuda.is_available()):
        raise ConfigError('--device: no such device: expected cpu, or cuda where there is a card, '
                          f'got {device}')
    torch.set_num_threads(threads)
    study = Study(data, models, out, model, pascal3d, tuple(training or ('train',)), samples,
                  starts, seed, threads, policy_seeds, policy_starts, subset_objects, device,
                  progress=progress_bar)
    wanted = [*PARTS, DOCUMENT] if ALL in parts else list(dict.fromkeys(parts))
    for part in wanted:
        if part == SYSTEMS:
            for system, weights in have_systems(study, systems(study)).items():
                typer.echo(f'{system.label}: {weights}')
        elif part == DOCUMENT:
            changed = write_document(study)
            typer.echo(f'{out / "README.md"}: {"written" if changed else "unchanged"}')
        else:
            made = run_part(study, part, again)
            typer.echo(f'{out / part}.md, .json, .png: {"written" if made else "unchanged"}')
