"""
What bf16 and int8 do to the IoU of the default network, and to the time of a view.

`python -m benchmarks.precision data/val [MODEL]` reconstructs 104 objects of a dataset from five
random views each, on one thread, in every precision in turns. It prints the IoU after each view,
how much it differs from that in f32, and the time of a view as a ratio to that in f32.
"""

import argparse
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
import time

from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.errors import ConfigError
from active_recon.geometry.canonical import network_image
from active_recon.models.weights_files import find_weights
from active_recon.runtimes import load_runtime, Runtime
from active_recon.runtimes.precision import chosen_precision
from active_recon.volumes.rendering import composite
from active_recon.volumes.voxels import iou
import numpy as np

_OBJECTS, _VIEWS = 104, 5


def _precisions() -> Iterator[str]:
    """Yield f32, and the others that this processor has."""
    yield 'f32'
    for precision in ('bf16', 'int8'):
        with suppress(ConfigError):
            chosen_precision(precision)
            yield precision


def main() -> None:
    """Measure the dataset that is named on the command line, by a model's exports."""
    parser = argparse.ArgumentParser(description='What bf16 and int8 do to the IoU and the time.')
    parser.add_argument('dataset', type=Path, help="folder of a dataset in R2N2's layout")
    parser.add_argument('model', nargs='?', help='a model that ships, or weights; default: the '
                                                 'default network')
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    folders = list_objects(options.dataset)
    chosen = [folders[index] for index in rng.permutation(len(folders))[:_OBJECTS]]
    precisions = list(_precisions())
    weights = find_weights(options.model)
    runtimes = [load_runtime(weights, 'openvino', threads=1, precision=precision)
                for precision in precisions]
    for runtime in runtimes:
        runtime.warm_up()
    found = np.array([_measured(folder, runtimes, rng) for folder in chosen])
    ious, spent = found[..., 0], found[..., 1]  # (objects, precisions, views)
    for index, precision in enumerate(precisions):
        apart = ious[:, index] - ious[:, 0]
        bound = 1.96 * apart.mean(1).std() / len(apart) ** 0.5
        _print(f'{precision}: IoU', ious[:, index].mean(0))
        _print(f'{precision}: mean difference from f32', apart.mean(0))
        _print(f'{precision}: that over all views, 95 %', [apart.mean(), bound])
        _print(f'{precision}: largest difference', np.abs(apart).max(0))
        _print(f'{precision}: time beside f32, median and 5 to 95 %',
               np.percentile(spent[:, index] / spent[:, 0], [50, 5, 95]))


def _measured(folder: ObjectFolder, runtimes: list[Runtime],
              rng: np.random.Generator) -> list[list[tuple[float, float]]]:
    """Return the IoU and the ms of each view in each runtime, (runtimes, views, 2)."""
    truth, cameras = folder.voxels(64).occupied(0.5), folder.cameras()
    states = [runtime.initial_state() for runtime in runtimes]
    rows: list[list[tuple[float, float]]] = [[] for _ in runtimes]
    for index in rng.permutation(len(cameras))[:_VIEWS]:
        view = composite(folder.image(index), 255), cameras[index]
        for number, runtime in enumerate(runtimes):
            taken = network_image(*view, runtime.spec)
            start = time.perf_counter()
            occupancy, _, states[number] = runtime.step(*taken, states[number])
            spent = 1e3 * (time.perf_counter() - start)
            rows[number].append((float(iou(occupancy > runtime.threshold, truth)), spent))
    return rows


def _print(name: str, values: object) -> None:
    print(f'{name:<45}', *(f'{value:.4f}' for value in np.asarray(values)))  # noqa: T201


if __name__ == '__main__':
    main()
