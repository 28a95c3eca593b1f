"""The default network in each runtime, with no ROS: a view, a plan, and the start of a process."""

from collections.abc import Iterator, Sequence
from copy import copy
from itertools import product
from pathlib import Path
import subprocess
import sys
import time

from active_recon.geometry.cameras import AZIMUTHS, Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import network_image
from active_recon.models.weights_files import find_weights, SMALL_MODEL
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import load_runtime
from active_recon.runtimes.precision import has_bf16, has_int8
from active_recon.segmentation import Segmentation
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import PUBLISHED_FLOOR
from benchmarks.figures import Figure, interleaved
import numpy as np

_CHAIR = Path(__file__).parents[1] / 'active_recon' / 'objects' / 'chair.glb'
_STARTS = 5
_RUNTIMES = ('torch', 'openvino')
_START = """
import os, sys
from active_recon.reconstructor import Reconstructor
from benchmarks.memory import peak_mb
Reconstructor.load(threads=1, runtime=sys.argv[1]).warm_up()
print(peak_mb(os.getpid()))
"""


def runtime_figures() -> list[Figure]:
    """Return the figures of torch, and of openvino in f32, and bf16 and int8 if the CPU can."""
    return [*_views(1), *_views(2), *_plans(24, 1), *_plans(200, 20), *_starts()]


def small_figures() -> list[Figure]:
    """Return the figures of a view of the small network, beside the default's in the same run."""
    return [figure for threads in (1, 2) for figure in _views(threads, (None, SMALL_MODEL))]


def segmenter_figures() -> list[Figure]:
    """Put the object on white by the segmenter, in an image of 640 x 480, on one thread."""
    camera = orbit_camera(0.3, intrinsics=Intrinsics(600, 600, 320, 240, 640, 480))
    tiles = np.kron(np.random.default_rng(0).integers(0, 256, (12, 16, 3), np.uint8),
                    np.ones((40, 40, 1), np.uint8))
    image = composite(Renderer(load_mesh(_CHAIR)).render(camera), tiles)
    tasks = {}
    for name in _RUNTIMES:
        segmentation = Segmentation.load(threads=1, runtime=name)
        tasks[f'the object put on white by the segmenter, {name}, threads: 1'] = (
            lambda segmentation=segmentation: segmentation.on_white(image, camera))
    return [Figure(name, 'ms', samples, None) for name, samples in interleaved(tasks).items()]


def _views(threads: int, models: Sequence[str | None] = (None,)) -> Iterator[Figure]:
    """Encode, update and decode, from the network's image to the occupancy of 64 cells."""
    ways = [('torch', 'f32'), ('openvino', 'f32')]
    ways += [('openvino', 'bf16')] if has_bf16() else []
    ways += [('openvino', 'int8')] if has_int8() and models == (None,) else []
    taken = _taken()
    tasks, goals = {}, {}
    for model, (name, precision) in product(models, ways):
        runtime = load_runtime(None if model is None else find_weights(model), name,
                               threads=threads, precision=precision)
        views = [network_image(*view, runtime.spec) for view in taken]
        state = runtime.initial_state()
        for view in views[:4]:
            _, _, state = runtime.step(*view, state)
        called = (f'a view{"" if model is None else f" of {model}"}, {name} {precision}, '
                  f'threads: {threads}')
        goals[called] = 4 if model is None else None
        tasks[called] = (
            lambda runtime=runtime, view=views[4], state=state: runtime.step(*view, state))
    for name, samples in interleaved(tasks).items():
        yield Figure(name, 'ms', samples, goals[name])


def _plans(count: int, goal: float) -> Iterator[Figure]:
    """Plan after five views with the learned policy, of candidates that it has planned with."""
    ring = np.linspace(0, 2 * np.pi, count, endpoint=False)
    places = [] if count == 24 else [
        number for azimuth in ring for number in (azimuth, 0.4 + 0.3 * np.sin(7 * azimuth), 0.0)]
    reconstructor = Reconstructor.load(threads=1)
    views = _taken()[:5]
    seen = [(reconstructor.add_view(*view), view[1]) for view in views]
    given = [(known.latent, camera, known.grid.entropy(), known.grid.above(PUBLISHED_FLOOR))
             for known, camera in seen]
    tasks = {}
    for name in _RUNTIMES:
        before = Planner.load('attention', max_views=10_000, entropy_tolerance=0, threads=1,
                              reachable_views=places, runtime=name)
        for view in given[:4]:
            before.add_view(*view)
        tasks[f'a plan of {count} candidates, {name}'] = (
            lambda before=before: copy(before).add_view(*given[4]))
    for name, samples in interleaved(tasks).items():
        yield Figure(name, 'ms', samples, goal)


def _starts() -> Iterator[Figure]:
    """Start a process until its network has run once, and the most that it holds by then."""
    for name in _RUNTIMES:
        times, peaks = [], []
        for _ in range(_STARTS + 1):  # the first compiles
            start = time.perf_counter()
            ended = subprocess.run([sys.executable, '-c', _START, name], cwd=_CHAIR.parents[2],
                                   capture_output=True, text=True, check=True)
            times.append(time.perf_counter() - start)
            peaks.append(float(ended.stdout))
        yield Figure(f'start to a network that has run, {name}', 's', times[1:], 0.5)
        yield Figure(f'peak memory of that, {name}', 'MB', peaks[1:], 150)


def _taken() -> list[tuple[np.ndarray, Camera]]:
    """Return images of the chair all around it, and their cameras."""
    renderer = Renderer(load_mesh(_CHAIR))
    cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS[::3]]
    return [(composite(renderer.render(camera), 255), camera) for camera in cameras]
