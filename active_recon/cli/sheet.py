"""`active-recon sheet`: an image of many objects of a category, or of training images."""

from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.needed_options import refuse_idle
from active_recon.errors import ConfigError, DataError
from active_recon.whole_files import writable
import typer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_TRAINING_VIEWS = 8


def sheet(
    context: typer.Context,
    out: Annotated[Path, typer.Argument(help='PNG file to write.')],
    category: Annotated[list[str] | None, typer.Option(
        help='Parametric category to show (may be given several times); default: all.')] = None,
    meshes: Annotated[Path | None, typer.Option(
        help='Folder of mesh files to show instead.')] = None,
    training: Annotated[Path | None, typer.Option(
        help='Dataset whose augmented training images are shown instead: one sequence of views '
             'in each row.')] = None,
    model: Annotated[str | None, typer.Option(
        show_default='lifting',
        help='With --training: the network whose images are shown. lifting takes any cameras, '
             "2d3d-attention the turntable's.")] = None,
    count: Annotated[int, typer.Option(
        min=1, help='Number of objects of each category; with --training, of rows.')] = 8,
    azimuth_deg: Annotated[float, typer.Option(
        help='Azimuth of the camera; 0 is the front.')] = 35.0,
) -> None:
    """
    Draw many objects in one image, to inspect them and compare them with real ones.

    Example: active-recon sheet chairs.png --category chair

    Example: active-recon sheet images.png --training data/train
    """
    from active_recon.png_files import write_png

    asked = {'--category': category, '--meshes': meshes, '--training': training}
    if len(given := [name for name, value in asked.items() if value]) > 1:
        raise ConfigError(f'sheet: several things to show: expected one of {", ".join(asked)}, '
                          f'got {" and ".join(given)}')
    if model is not None and training is None:
        raise ConfigError('sheet: --model without --training: expected a dataset whose training '
                          'images are shown as the network sees them, got none')
    refuse_idle(context, 'with --training', training is not None, 'azimuth_deg')
    refuse_idle(context, 'with --meshes, which shows all of them', meshes is not None, 'count')
    if out.suffix.lower() != '.png':
        raise ConfigError(f'{out}: no PNG file: expected a path that ends with .png')
    writable(out)
    picture = _objects(category, meshes, count, azimuth_deg) if training is None else (
        _training(training, count, model or 'lifting'))
    write_png(out, picture[..., ::-1])
    typer.echo(f'wrote {out}')


def _objects(category: list[str] | None, meshes: Path | None, count: int,
             azimuth_deg: float) -> 'NDArray[np.uint8]':
    import math

    from active_recon.datasets.making import mesh_files, MESH_SUFFIXES
    from active_recon.shapes import ALL_CATEGORIES, make_shape
    from active_recon.volumes.meshes import load_mesh
    from active_recon.volumes.sheet import contact_sheet

    if meshes is None:
        objects = [make_shape(name, seed)
                   for name in category or ALL_CATEGORIES for seed in range(count)]
    else:
        objects = [load_mesh(path) for path in mesh_files(meshes)]
    if not objects:
        raise DataError(f'{meshes}: no mesh files: expected some '
                        f'({", ".join(sorted(MESH_SUFFIXES))}), found none')
    return contact_sheet(objects, azimuth=math.radians(azimuth_deg))


def _training(root: Path, rows: int, model: str) -> 'NDArray[np.uint8]':
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.views import read_views
    from active_recon.models.registry import named_network, network_config, network_entry
    from active_recon.training.batches import draw_batch
    from active_recon.training.posed_batches import draw_posed_batch
    from active_recon.volumes.sheet import sequence_sheet
    import numpy as np

    name = named_network(model)
    spec = network_entry(name).build(network_config(name, 'small')).spec
    rng = np.random.default_rng(0)
    folders = list_objects(root)
    some = [folders[index] for index in rng.permutation(len(folders))[:4 * rows]]
    views = read_views(some, image_size=spec.image_size, framed=not spec.needs_front)
    if spec.needs_front:
        return sequence_sheet(draw_batch(views, rows, _TRAINING_VIEWS, rng).images)
    return sequence_sheet(draw_posed_batch(views, rows, _TRAINING_VIEWS, rng).images[:, :, :3])
