"""`active-recon sheet`: what a category looks like, on one picture."""

from pathlib import Path
from typing import Annotated

from active_recon.errors import DataError
import typer


def sheet(
    out: Annotated[Path, typer.Argument(help='Where the picture goes (PNG).')],
    category: Annotated[list[str] | None, typer.Option(
        help='A parametric category (may be given several times); default: all.')] = None,
    meshes: Annotated[Path | None, typer.Option(
        help='A folder of mesh files to draw instead.')] = None,
    count: Annotated[int, typer.Option(min=1, help='Objects of each category.')] = 8,
    azimuth_deg: Annotated[float, typer.Option(help='Seen from; 0 is the front.')] = 35.0,
) -> None:
    """Draw many objects on one picture, to look at and to compare with real ones."""
    import math

    from active_recon.datasets.making import MESH_SUFFIXES
    from active_recon.meshes import load_mesh
    from active_recon.shapes import CATEGORIES, make_shape
    from active_recon.sheet import contact_sheet
    import cv2

    if meshes is None:
        objects = [make_shape(name, seed)
                   for name in category or CATEGORIES for seed in range(count)]
    else:
        objects = [load_mesh(path) for path in sorted(meshes.rglob('*'))
                   if path.suffix.lower() in MESH_SUFFIXES]
    if not objects:
        raise DataError(f'{meshes}: expected mesh files, found none')
    picture = contact_sheet(objects, azimuth=math.radians(azimuth_deg))
    out.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(out), picture[..., ::-1]):
        raise DataError(f'{out}: cannot be written')
    typer.echo(f'wrote {out}: {len(objects)} objects')
