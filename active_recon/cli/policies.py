"""`active-recon policies`: what view policies are worth on a network of posed views."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.bf16_option import Bf16, in_bf16
from active_recon.cli.command_line import command_line
from active_recon.cli.needed_options import refuse_lone
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import print_left_out
from active_recon.cli.runtime_option import MeasuredIn
from active_recon.cli.study_files import require_writable_study, write_study
from active_recon.errors import ConfigError, DataError
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.policies import POLICIES
import typer

if TYPE_CHECKING:
    from active_recon.evaluation.next_view.study import Episodes
    from active_recon.evaluation.posed.entrants import Entrant
    from active_recon.evaluation.posed.scene import Scene
    from active_recon.evaluation.posed.study import Extent

_UNLEARNED = [name for name, entry in POLICIES.items() if not entry.is_learned]
_LEARNED = [name for name in POLICIES if name not in _UNLEARNED]


def policies(
    context: typer.Context,
    data: Annotated[list[Path], typer.Argument(
        help="Folders of objects in R2N2's layout, each measured by itself; `--cameras turntable` "
             'leaves azimuths to choose, `--cameras dome` elevations too.')],
    model: Annotated[str, typer.Option(
        help='A network of posed views: a model that ships, or a weights file.')] = DEFAULT_MODEL,
    names: Annotated[str | None, typer.Option(
        '--policies', help=f'Policies, separated by commas, out of {", ".join(POLICIES)}, '
        'sequence (the best that is the same for all objects, found on --training), swapped '
        '(attention, shown the volume of another object), swapped_turned (of that object, turned '
        'by a drawn angle), peeking, oracle and together (which see what no robot does; together '
        'tries all pairs of second and third views); NAME@COST is a policy whose motion costs so '
        'much IoU a second. Default: all but the swapped ones and together, attention only where '
        'the model has a learned policy, sequence only with --training.')] = None,
    training: Annotated[Path | None, typer.Option(
        help='Folder of other objects, on which the sequence is found.')] = None,
    objects: Annotated[int, typer.Option(
        min=2, help='At most so many objects of a folder, drawn.')] = 24,
    training_objects: Annotated[int, typer.Option(
        min=1, help='The same of the training folder.')] = 16,
    category: Annotated[str | None, typer.Option(
        help="Objects of these categories alone, as a pattern: 'thing_*', or '!thing_*' for all "
             'others.')] = None,
    views: Annotated[int, typer.Option(min=2, max=24, help='Views of an episode.')] = 5,
    starts: Annotated[int, typer.Option(min=1, help='First views of each object, drawn.')] = 2,
    seeds: Annotated[int, typer.Option(min=1, help='How often random is drawn.')] = 3,
    seed: Annotated[int, typer.Option(
        min=0, help='Draws objects, first views, renderings and random views.')] = 0,
    out: Annotated[Path, typer.Option(
        help='Folder where policies.json and policies.md go.')] = Path('study'),
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    runtime: MeasuredIn = 'torch',
) -> None:
    """
    Measure what choosing views is worth: policies beside chance, a fixed sequence and an oracle.

    Views are chosen on one rendering of the objects and judged on another (other light, image
    noise, poses off by half a degree), so that the oracle's luck does not count: the lead over
    random that it keeps there is the repeatable gap. An object takes one to two minutes of a core,
    most of it for the oracle and peeking.

    For example:

      active-recon policies data/test --training data/train --out build/policies

      active-recon policies data/test --policies random,uniform,farthest --objects 60
    """
    from active_recon.datasets.layout import needed_objects
    from active_recon.evaluation.next_view.study import Episodes, require_policies
    from active_recon.evaluation.posed.entrants import load_entrants
    from active_recon.evaluation.posed.scene import chosen_folders
    from active_recon.evaluation.posed.study import Extent
    from active_recon.models.weights_files import scorer_path
    import torch

    torch.set_num_threads(threads)
    half = in_bf16(bf16)
    entrant, *others = load_entrants(model, runtime, half, threads)
    if others:
        raise ConfigError(f'model: several networks: expected one, got {model!r}')
    learned = _LEARNED if scorer_path(entrant.path).is_file() else []
    wanted = [*_UNLEARNED, *learned, *['sequence'] * (training is not None), 'peeking', 'oracle']
    if names is not None:
        wanted = [name.strip() for name in names.split(',') if name.strip()]
    has_sequence = 'sequence' in {name.partition('@')[0] for name in wanted}
    if has_sequence and training is None:
        raise ConfigError('policies: no training objects: expected --training with a folder, on '
                          'which a sequence is found, got none; give one, or leave sequence out')
    refuse_lone(context, 'sequence among --policies', has_sequence, 'training', 'training_objects')
    episodes = Episodes(tuple(dict.fromkeys(wanted)), starts, views, seeds, seed, half)
    for folder in (*data, *([training] if training is not None else [])):
        chosen_folders(needed_objects(folder), category)
    require_policies(entrant, episodes)
    require_writable_study(out, 'policies')
    # All of this, and which folder is unfit, is told before hours of measuring
    scenes = [(folder, _read(folder, entrant, episodes, Extent(category, objects)))
              for folder in data]
    result: dict[str, Any] = {
        'command': command_line(), 'model': entrant.name,
        'weights': entrant.weights, 'sets': []}
    if training is not None:
        if any(training.resolve() == each.resolve() for each in data):
            typer.echo('warning: --training is measured, too: what is told of the sequence is too '
                       'good', err=True)
        result['sequence'] = _sequence(training, entrant, episodes,
                                       Extent(category, training_objects))
    for folder, scene in scenes:
        result['sets'].append(
            {'data': str(folder), 'category': category}
            | _set_figures(folder, scene, entrant, episodes, result.get('sequence')))
        _write(result, out)  # what is done is kept, should a later folder fail
    for name in ('policies.json', 'policies.md'):
        typer.echo(f'wrote {out / name}')


def _sequence(folder: Path, entrant: 'Entrant', episodes: 'Episodes',
              extent: 'Extent') -> dict[str, Any]:
    from active_recon.evaluation.next_view.study import find_offsets
    from active_recon.evaluation.posed.study import read_set
    import numpy as np

    scene = read_set(folder, [entrant], extent, episodes.seed, progress_bar)
    print_left_out(folder.name, len(scene), (), scene.views.unreadable)
    steps = min(episodes.count, scene.view_count) - 1
    with progress_bar('finding a sequence', len(scene) * steps) as advance:
        offsets = find_offsets(scene, entrant, episodes, lambda done: advance(done, ''))
    return {'data': str(folder), 'objects': len(scene),
            'offsets_deg': np.degrees(offsets).round(1).tolist()}


def _read(folder: Path, entrant: 'Entrant', episodes: 'Episodes', extent: 'Extent') -> 'Scene':
    """Return a folder's objects; raises where the policies cannot be measured on them."""
    from active_recon.evaluation.next_view.study import shown_views
    from active_recon.evaluation.next_view.swapping import require_same_cameras
    from active_recon.evaluation.posed.study import read_set

    scene = read_set(folder, [entrant], extent, episodes.seed, progress_bar)
    print_left_out(folder.name, len(scene), (), scene.views.unreadable)
    shown_views(scene, entrant)
    if any(name.startswith('swapped') for name in episodes.policies):
        if len(scene) < 2:
            raise DataError(f'{folder}: no other object to show: expected two or more for '
                            'swapped, got one; give more, or leave swapped out')
        require_same_cameras(scene.views)
    return scene


def _set_figures(folder: Path, scene: 'Scene', entrant: 'Entrant', episodes: 'Episodes',
                 sequence: Mapping[str, Any] | None) -> dict[str, Any]:
    from active_recon.evaluation.next_view.study import figures, run_episodes
    import numpy as np

    offsets = None if sequence is None else np.radians(sequence['offsets_deg'])
    with progress_bar(f'choosing views of {folder.name}', len(scene)) as advance:
        found = run_episodes(scene, entrant, episodes, offsets, lambda done: advance(done, ''))
    return {'objects': len(scene),
            'views': scene.view_count, 'starts': min(episodes.starts, scene.view_count),
            'side': max(side for side in entrant.sides if side in scene.truths),
            'unreadable': list(scene.views.unreadable), **figures(found)}


def _write(result: Mapping[str, Any], out: Path) -> None:
    from active_recon.evaluation.next_view.summary import markdown

    write_study(result, markdown(result), out, 'policies')
