"""
One timed reconstruction in a fresh process, with JSON on standard output.

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

    Loading includes the import of the runtime. `predictions` are the seconds of each view's
    prediction; the step `making prediction` is the first.
    """
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(step: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        seconds[step] = time.perf_counter() - start

    with timed('loading models'):
        from active_recon.datasets.layout import ObjectFolder
        from active_recon.geometry.canonical import network_image
        from active_recon.meshes.files import write_mesh
        from active_recon.runtimes import load_runtime
        from active_recon.volumes.binvox import write_binvox
        from active_recon.volumes.rendering import composite
        from active_recon.volumes.voxels import VoxelGrid
        runtime = load_runtime(Path(weights), 'torch', threads=int(threads))
    with timed('pre-processing data'):
        folder = ObjectFolder(Path(root), category, name)
        camera = folder.cameras()[0]
        shown = network_image(composite(folder.image(0), 255), camera, runtime.spec)
    state = runtime.initial_state()
    with timed('making prediction'):
        occupancy, _, state = runtime.step(*shown, state)
    with timed('preserving outputs'):
        grid = VoxelGrid(occupancy)
        write_binvox(grid, Path(out) / 'model.binvox', runtime.threshold)
        if grid.occupied(runtime.threshold).any():
            write_mesh(grid.mesh(runtime.threshold), Path(out) / 'model.ply')
    predictions = [seconds['making prediction']]
    for index in range(1, int(views)):
        more = network_image(composite(folder.image(index), 255), folder.cameras()[index],
                             runtime.spec)
        with timed('again'):
            _, _, state = runtime.step(*more, state)
        predictions.append(seconds.pop('again'))
    sys.stdout.write(json.dumps({'steps': seconds, 'predictions': predictions}))


if __name__ == '__main__':
    main(*sys.argv[1:])
