"""`active-recon record-sweep`: records a bag of all 24 azimuths of a simulated turntable."""

from pathlib import Path
from typing import Annotated

import typer


def record_sweep(
    model: Annotated[str, typer.Argument(
        help='bed, car, chair, sofa, table, or the path of a mesh file.')],
    out: Annotated[Path, typer.Option(help='The folder of the bag, which must not exist yet.')],
    object_size: Annotated[float, typer.Option(
        min=0.001, max=1000.0, help='Side of the voxel grid, metres.')] = 1.0,
    background: Annotated[float, typer.Option(
        min=0.0, max=255.0, help='Grey value of the background.')] = 255.0,
    up: Annotated[str | None, typer.Option(
        help='Axis of the mesh file that points up: x, y, z, with or without a sign. Default: '
             'y for glTF and GLB, z for others.')] = None,
    front: Annotated[str | None, typer.Option(
        help="Axis of the mesh file that points to the object's front. Default: z for glTF and "
             'GLB, x for others.')] = None,
) -> None:
    """
    Record all 24 azimuths of an object on a simulated turntable, without ROS.

    Such a bag can be replayed with any policy, because it has every view that a policy can choose.

    Example: active-recon record-sweep chair --out bags/chair-sweep
    """
    from active_recon.bags.runs.sweep import record_sweep
    from active_recon.cli.progress import progress_bar
    from active_recon.geometry.cameras import AZIMUTHS
    from active_recon.objects import find_object
    from active_recon.simulation.shown_object import rendered_object

    with progress_bar('rendering and recording', len(AZIMUTHS)) as advance:
        shown = rendered_object(find_object(model), object_size, background, up, front)
        given = {'mesh': model, 'up': up, 'front': front}
        record_sweep(shown, out, object_size=object_size, advance=lambda: advance(1, ''),
                     mesh={name: value for name, value in given.items() if value is not None})
    typer.echo(f'{len(shown.images)} views of {shown.name} are in {out}')
