"""`active-recon quality`: measures, fits and tests how the quality of a shape is judged."""

from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.command_line import command_line
from active_recon.cli.progress import progress_bar
from active_recon.cli.study_files import require_writable_study, write_study
from active_recon.errors import ConfigError, DataError
from active_recon.whole_files import writable
import typer

if TYPE_CHECKING:
    from active_recon.datasets.layout import ObjectFolder

quality = typer.Typer(help='How good a shape is, judged without the truth.', no_args_is_help=True)

Model = Annotated[str | None, typer.Option(
    help='The network: a model that ships, or a weights file.')]
_BATCH = 4
_APART = 2 ** 32
"""How far the seeds of two measurements are apart: of one, each batch of objects has its own."""
_SOURCES, _FITTED_BY = 'calibrated_on', 'heads_fitted_by'
"""What tables tell of the first half's sources, and of the command that fitted what was kept."""


@quality.command()
def measure(
    data: Annotated[Path, typer.Argument(help="Folder of objects in R2N2's layout, voxelised "
                                              'at the resolution of the network.')],
    out: Annotated[Path, typer.Argument(help='The npz file to write.')],
    views: Annotated[int, typer.Option(
        min=1, help='Views of each object; 6 to calibrate tables that ship.')] = 5,
    kind: Annotated[str, typer.Option(
        help="Order of the views: 'random', 'even', or 'attention': those that the learned policy "
             'of the weights chooses.')] = 'random',
    fault: Annotated[str | None, typer.Option(
        help='Spoil the views: unknown (noise), pose, object_size, mask.')] = None,
    objects: Annotated[int | None, typer.Option(
        min=1, help='Largest number of objects, drawn at random; default: all.')] = None,
    seed: Annotated[int, typer.Option(min=0, help='Seed of objects, orders and faults.')] = 0,
    model: Model = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
) -> None:
    """
    Reconstruct objects view by view, and write what their quality is judged by beside the truth.

    Example: active-recon quality measure data/real_val real.npz --views 6
    """
    from active_recon.datasets.layout import needed_objects
    from active_recon.datasets.views import read_views
    from active_recon.evaluation.posed.scene import chosen_folders
    from active_recon.evaluation.quality.faults import FAULTS
    from active_recon.evaluation.quality.measuring import KINDS, LEARNED, Measured
    from active_recon.evaluation.quality.measuring import measure as measured
    from active_recon.models.weights import load_weights
    from active_recon.models.weights_files import find_weights, weights_hash
    from active_recon.policies import load_policy, PolicyOptions
    import torch

    for name, value, known in (('kind', kind, KINDS), ('fault', fault or '', ('', *FAULTS))):
        if value not in known:
            raise ConfigError(f'--{name}: unknown value: expected one of '
                              f'{", ".join(filter(None, known))}, got {value!r}')
    torch.set_num_threads(threads)
    weights = find_weights(model)
    sha256, bundle = weights_hash(weights), load_weights(weights)
    network = bundle.reconstruction
    policy = load_policy(LEARNED, PolicyOptions(
        views=views, weights=weights, threads=threads)) if kind == LEARNED else None
    writable(out)  # tells before minutes of measuring
    alike: dict[int, list[ObjectFolder]] = {}  # all of a batch are shown from as many views
    for folder in chosen_folders(needed_objects(data), None, objects, seed):
        alike.setdefault(_views_of(folder), []).append(folder)
    if views > (most := max(alike)) > 0:
        raise ConfigError(f'--views: too many: expected at most the {most} of the objects, got '
                          f'{views}')
    left_out = [f'{folder.images_folder}: too few views: expected {views} or more, got {count}'
                for count in sorted(alike) if 0 < count < views for folder in alike.pop(count)]
    batches = [some[low:low + _BATCH] for _, some in sorted(alike.items(), reverse=True)
               for low in range(0, len(some), _BATCH)]
    parts, done = [], 0
    with progress_bar(f'measuring {data.name}', sum(map(len, batches))) as advance:
        for few in batches:
            try:
                shown = read_views(few, resolution=network.resolution,
                                   image_size=network.image_size, framed=True)
            except DataError as error:  # of these few no one; perhaps of the others
                left_out.append(str(error))
            else:
                left_out += shown.unreadable
                parts.append(measured(shown, network, bundle.threshold, views, kind, fault or '',
                                      seed * _APART + done, policy, sha256))
            done += len(few)
            advance(len(few), '')
    for reason in left_out:
        typer.echo(f'left out: {reason}', err=True)
    if not parts:
        raise DataError(f'{data}: no readable object: expected at least one, got none')
    Measured.joined(parts).write(out)
    typer.echo(f'wrote {out}')


def _views_of(folder: 'ObjectFolder') -> int:
    """Return the number of an object's views, 0 where it cannot be read."""
    try:
        return len(folder.cameras())
    except DataError:
        return 0


@quality.command()
def fit(
    calibration: Annotated[list[Path], typer.Option(
        help='Measured on objects that nothing was fitted to, with and without faults (may be '
             'given several times). The first of two halves, split by source, is used; without '
             '--known that of the tables that there are, if some of its sources were measured.')],
    known: Annotated[list[Path] | None, typer.Option(
        help='Measured without faults: objects of training and validation (may be given several '
             'times). Default: what is fitted stays as it is in the tables beside the weights, '
             'and only the bounds, the promises and what is usual are calibrated anew.')] = None,
    out: Annotated[Path | None, typer.Option(
        help='The JSON file to write; default: beside the weights, where it is used.')] = None,
    model: Model = None,
) -> None:
    """
    Fit the tables by which the quality of a network's shapes is judged.

    Example: active-recon quality fit --known train.npz --calibration real.npz --calibration
    real-pose.npz

    To calibrate tables for objects and cameras of your own, beside a copy of the weights:
    active-recon quality fit --calibration mine.npz --model mine/lifting-large.safetensors
    """
    from active_recon.evaluation.quality.faults import FAULTS
    from active_recon.evaluation.quality.fitting import calibrated
    from active_recon.evaluation.quality.fitting import fit as fitted
    from active_recon.evaluation.quality.measuring import halves, Measured
    from active_recon.models.weights_files import find_weights, read_card, weights_hash
    from active_recon.quality.judge import FEWEST_USUAL
    from active_recon.quality.tables import needed_tables, tables_path

    weights = find_weights(model)
    sha256 = weights_hash(weights)
    path = writable(out or tables_path(weights))
    together = Measured.read_all(calibration, sha256)
    if known:
        first, notes = together.rows(halves(together)), {}
        tables = fitted(Measured.read_all(known, sha256), first, sha256)
        if lacking := [name for name in FAULTS if name not in tables.suspects]:
            typer.echo(f'warning: no objects with the fault {", ".join(lacking)} in the half that '
                       'is used: it is never suspected; measure some, see --fault', err=True)
    else:
        heads, earlier = needed_tables(weights, sha256), read_card(tables_path(weights))
        first = together.rows(halves(together, earlier.get(_SOURCES, ())))
        tables = calibrated(heads, first)
        notes = {_FITTED_BY: earlier.get(_FITTED_BY, earlier.get('command', ''))}
    if tables.fewest_usual < FEWEST_USUAL:
        typer.echo(f'warning: calibrated on {tables.fewest_usual} episodes: expected '
                   f'{FEWEST_USUAL} or more in this half, else no view is flagged as unusual and '
                   'no target promised; measure more', err=True)
    tables.write(path, **{'command': command_line(), **notes,
                          _SOURCES: sorted(set(first.source.tolist()))})
    typer.echo(f'wrote {path}')


@quality.command()
def study(
    files: Annotated[list[Path] | None, typer.Argument(
        help='Measured objects that nothing was fitted to: one set, with and without faults.')
    ] = None,
    halved: Annotated[list[Path] | None, typer.Option(
        help='The files that `fit` was calibrated on: the other half of them, of sources that it '
             'did not use, is one set.')] = None,
    out: Annotated[Path, typer.Option(
        help='Folder for quality.json and quality.md.')] = Path('quality'),
    model: Model = None,
    tables: Annotated[Path | None, typer.Option(
        help='The JSON file of `fit`; default: that beside the weights.')] = None,
) -> None:
    """
    Test what is said of quality on objects that nothing was fitted to.

    Example: active-recon quality study test.npz test-pose.npz --halved real.npz --halved
    real-pose.npz
    """
    from active_recon.evaluation.quality.measuring import halves, Measured
    from active_recon.evaluation.quality.study import study as studied
    from active_recon.evaluation.quality.summary import markdown
    from active_recon.models.weights_files import find_weights, read_card
    from active_recon.quality.tables import QualityTables, tables_path

    if not files and not halved:
        raise ConfigError('study: nothing to measure: expected files of `quality measure`, or '
                          '--halved with some, got neither')
    path = tables or tables_path(find_weights(model))
    found = QualityTables.read(path)
    sha256, sets = found.weights_sha256, {}
    if files:
        sets[files[0].stem] = Measured.read_all(files, sha256)
    if halved:
        together = Measured.read_all(halved, sha256)
        second = together.rows(~halves(together, read_card(path).get(_SOURCES, ())))
        if not len(second):
            raise DataError('--halved: no object of the second half: expected some of sources '
                            f'that {path} was not calibrated on, got none')
        sets[f'{halved[0].stem}, second half'] = second
    require_writable_study(out, 'quality')
    result = {'command': command_line(), 'weights_sha256': sha256,
              'sets': [{'name': name, **studied(each, found)} for name, each in sets.items()]}
    figures, page = write_study(result, markdown(result), out, 'quality')
    typer.echo(f'wrote {figures} and {page}')
