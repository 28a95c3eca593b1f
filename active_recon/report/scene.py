"""The data of the page's 3D view: the cells after each view, as JSON values."""

from base64 import b64encode
import math
from typing import Any

from active_recon.report.charts import view_color
from active_recon.report.subject import shown_grid, Subject
import numpy as np
from numpy.typing import NDArray

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
        'grids': [None if grid is None else encoded(grid.occupancy, subject.threshold)
                  for grid in grids],
        'truth': None if subject.truth is None else encoded(
            subject.truth.astype(np.float32), 0.5),
        'side': next((len(grid.occupancy) for grid in grids if grid is not None), 0),
        'threshold': subject.threshold,
        'cameras': [{'azimuth': view.camera.azimuth, 'color': view_color(number)}
                    for number, view in enumerate(subject.views, 1)],
    }


def encoded(occupancy: NDArray[np.float32], threshold: float) -> str:
    """Return occupancies as the page reads them, rounded so that each keeps to its side."""
    steps = np.rint(np.clip(occupancy, 0, 1) * STEPS)
    last = math.floor(threshold * STEPS)  # that the page does not draw
    steps = np.where(occupancy > threshold, np.maximum(steps, last + 1), np.minimum(steps, last))
    return b64encode(steps.astype('<u2').tobytes()).decode()
