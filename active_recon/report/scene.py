"""The data of the page's 3D view: the cells after each view, as JSON values."""

from base64 import b64encode
from typing import Any

from active_recon.report.charts import view_color
from active_recon.report.subject import shown_grid, Subject
import numpy as np

STEPS = 65535
"""The value of an occupancy of 1 on the page, where occupancies are 16-bit integers."""


def scene(subject: Subject) -> dict[str, Any]:
    """
    Return the cells after each view and the cameras around them.

    `grids` has base64 of little-endian uint16 in the order [x, y, z], null without a shape;
    `truth` the same of the true cells. Lengths are in sides of the cube.
    """
    grids = [shown_grid(view) for view in subject.views]
    return {
        'grids': [None if grid is None else _encoded(grid.occupancy) for grid in grids],
        'truth': None if subject.truth is None else _encoded(subject.truth.astype(np.float32)),
        'side': next((len(grid.occupancy) for grid in grids if grid is not None), 0),
        'threshold': subject.threshold,
        'cameras': [{'azimuth': view.camera.azimuth, 'color': view_color(number)}
                    for number, view in enumerate(subject.views, 1)],
    }


def _encoded(occupancy: np.ndarray[Any, np.dtype[np.float32]]) -> str:
    steps = np.rint(np.clip(occupancy, 0, 1) * STEPS).astype('<u2')
    return b64encode(steps.tobytes()).decode()
