"""
What bf16 does to the IoU of the default network.

`python -m benchmarks.precision data/test` reconstructs 60 objects of a dataset from five random
views each, in f32 and in bf16, and prints the IoU after every view and their differences.
"""

from pathlib import Path
import sys

from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.geometry.canonical import network_image
from active_recon.runtimes import load_runtime, Runtime
from active_recon.volumes.rendering import composite
from active_recon.volumes.voxels import iou
import numpy as np

_OBJECTS, _VIEWS = 60, 5


def main() -> None:
    """Measure the dataset that is named on the command line."""
    rng = np.random.default_rng(0)
    folders = list_objects(Path(sys.argv[1]))
    chosen = [folders[index] for index in rng.permutation(len(folders))[:_OBJECTS]]
    runtimes = [load_runtime(None, 'openvino', threads=1, precision=precision)
                for precision in ('f32', 'bf16')]
    found = np.array([_ious(folder, runtimes, rng.permutation(24)[:_VIEWS]) for folder in chosen])
    apart = found[:, 1] - found[:, 0]
    for name, values in (('f32', found[:, 0].mean(0)), ('bf16', found[:, 1].mean(0)),
                         ('mean difference', apart.mean(0)),
                         ('largest difference', np.abs(apart).max(0))):
        print(f'{name:<20}', *(f'{value:.5f}' for value in values))  # noqa: T201


def _ious(folder: ObjectFolder, runtimes: list[Runtime], order: np.ndarray) -> np.ndarray:
    """Return the IoU of each runtime after each of some views, (runtimes, views)."""
    truth = folder.voxels(64).occupied(0.5)
    views = [(composite(folder.image(index), 255), folder.cameras()[index]) for index in order]
    rows = []
    for runtime in runtimes:
        state, row = runtime.initial_state(), []
        for view in views:
            occupancy, _, state = runtime.step(*network_image(*view, runtime.spec), state)
            row.append(float(iou(occupancy > runtime.threshold, truth)))
        rows.append(row)
    return np.array(rows)


if __name__ == '__main__':
    main()
