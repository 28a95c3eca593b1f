"""`active-recon record-sweep`: records a bag of all 24 azimuths of a simulated turntable."""

from pathlib import Path
from typing import Annotated

import typer


def record_sweep(
    model: Annotated[str, typer.Argument(
        help='bed, car, chair, sofa, table, or the path of a mesh file.')],
    out: Annotated[Path, typer.Option(help='The folder of the bag, which must not exist yet.')],
    object_size: Annotated[float, typer.Option(
        min=0.001, max=1000.0, help='Side of the voxel grid, m.')] = 1.0,
    background: Annotated[float, typer.Option(
        min=0.0, max=255.0, help='Grey behind the object.')] = 255.0,
    up: Annotated[str | None, typer.Option(
        help="The mesh file's axis that is up: x, y, z, or with a sign. Default: its "
             "format's.")] = None,
    front: Annotated[str | None, typer.Option(
        help="The mesh file's axis of the front; likewise.")] = None,
) -> None:
    """
    Record all 24 azimuths of an object on a simulated turntable, without ROS.

    Such a bag can be replayed with any policy: it has every view that one may ask for.

    Example: active-recon record-sweep chair --out bags/chair-sweep
    """
    from active_recon.bags.runs.sweep import record_sweep
    from active_recon.cli.progress import progress_bar
    from active_recon.geometry.cameras import AZIMUTHS
    from active_recon.objects import find_object
    from active_recon.simulation.shown_object import rendered_object

    with progress_bar('rendering and recording', len(AZIMUTHS)) as advance:
        shown = rendered_object(find_object(model), object_size, background, up, front)
        record_sweep(shown, out, object_size=object_size, advance=lambda: advance(1, ''))
    typer.echo(f'{len(shown.images)} views of {shown.name} are in {out}')
