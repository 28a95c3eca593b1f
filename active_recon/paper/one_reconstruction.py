"""
One reconstruction in a process of its own, its steps timed; JSON on standard output.

`python -m active_recon.paper.one_reconstruction DATASET CATEGORY NAME WEIGHTS THREADS VIEWS OUT`
"""

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path
import sys
import time


def main(root: str, category: str, name: str, weights: str, threads: str, views: str,
         out: str) -> None:
    """
    Reconstruct an object from its first views, and write the seconds of each step.

    Loading counts the import of what runs the network. `predictions` are the seconds of each
    view's prediction; the step `making prediction` is the first.
    """
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(step: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        seconds[step] = time.perf_counter() - start

    with timed('loading models'):
        from active_recon.canonical import canonical_image
        from active_recon.datasets.layout import ObjectFolder
        from active_recon.models.runtime import Runtime, TorchRuntime
        from active_recon.models.weights import load_weights
        from active_recon.rendering import composite
        from active_recon.voxels import VoxelGrid, write_binvox, write_mesh
        import torch
        torch.set_num_threads(int(threads))
        bundle = load_weights(Path(weights))
        runtime: Runtime = TorchRuntime(bundle.reconstruction)
    with timed('pre-processing data'):
        folder = ObjectFolder(Path(root), category, name)
        camera = folder.cameras()[0]
        image = canonical_image(composite(folder.image(0), 255), camera)
    state = runtime.initial_state()
    with timed('making prediction'):
        occupancy, _, state = runtime.step(image, camera.azimuth, state)
    with timed('preserving outputs'):
        grid = VoxelGrid(occupancy)
        write_binvox(grid, Path(out) / 'model.binvox', bundle.threshold)
        if grid.occupied(bundle.threshold).any():
            write_mesh(grid.mesh(bundle.threshold), Path(out) / 'model.ply')
    predictions = [seconds['making prediction']]
    for index in range(1, int(views)):
        more = canonical_image(composite(folder.image(index), 255), folder.cameras()[index])
        with timed('again'):
            _, _, state = runtime.step(more, folder.cameras()[index].azimuth, state)
        predictions.append(seconds.pop('again'))
    sys.stdout.write(json.dumps({'steps': seconds, 'predictions': predictions}))


if __name__ == '__main__':
    main(*sys.argv[1:])
