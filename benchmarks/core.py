"""The core, with no ROS: one view reconstructed and planned, views and candidates rendered."""

from collections.abc import Iterator
from pathlib import Path
import time

from active_recon.geometry.cameras import AZIMUTHS, Intrinsics, orbit_camera
from active_recon.geometry.canonical import framed_image
from active_recon.geometry.lenses import Distortion
from active_recon.models.lifting_encoder import IMAGE_SIZE
from active_recon.planner import Planner
from active_recon.policies.candidate_rendering import coarse_volume, render_candidates
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import PUBLISHED_FLOOR
from benchmarks.figures import Figure, interleaved, timed_ms
import numpy as np

OBJECTS = Path(__file__).parents[1] / 'active_recon' / 'objects'
_EPISODES = 6
MODELS = Path(__file__).parent / 'real_cc0'


def episode_figures() -> list[Figure]:
    """Reconstruct and plan all around the chair, on one thread and on two."""
    return [figure for threads in (1, 2) for figure in _episodes(threads)]


def _episodes(threads: int) -> Iterator[Figure]:
    """Each view goes through network, grid, entropy and learned policy, as in the two nodes."""
    reconstructor = Reconstructor.load(threads=threads)
    planner = Planner.load('attention', max_views=10_000, entropy_tolerance=0, threads=threads)
    cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
    renderer = Renderer(load_mesh(OBJECTS / 'chair.glb'))
    images = [composite(renderer.render(camera), 255) for camera in cameras]
    spent = np.zeros((_EPISODES + 1, len(cameras)))
    for episode in spent:
        reconstructor.reset()
        planner.reset()
        for number, (image, camera) in enumerate(zip(images, cameras, strict=True)):
            start = time.perf_counter()
            seen = reconstructor.add_view(image, camera)
            planner.add_view(seen.latent, camera, seen.grid.entropy(),
                             seen.grid.above(PUBLISHED_FLOOR))
            episode[number] = 1e3 * (time.perf_counter() - start)
    kept, where = spent[1:], f'default network, threads: {threads}'  # the first warms up
    yield Figure(f'a view reconstructed and planned, {where}', 'ms', kept.ravel(), 5)
    yield Figure(f'five views with their plans, {where}', 'ms', kept[:, :5].sum(axis=1), 25)
    yield Figure(f'the 24th view beside the first, {where}', 'times',
                 kept[:, -1] / np.median(kept[:, 0]), 1.05)


def rendering(samples: int, goal: float) -> Figure:
    """Render the real models that ship (under 20,000 faces), on one core: views a second."""
    rates = []
    for path in sorted(MODELS.glob('*/*.glb')):
        mesh = load_mesh(path)
        if len(mesh.faces) >= 20_000:
            continue
        renderer = Renderer(mesh)
        cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
        spent = timed_ms(lambda r=renderer, c=cameras: [r.render(one, samples) for one in c], 1, 1)
        rates.append(1e3 * len(cameras) / float(np.median(spent)))
    kind = 'flat' if samples == 1 else f'{samples} x {samples} antialiasing'
    return Figure(f'rendering, {kind}', 'views/s', rates, goal, more_is_better=True)


def framing_figures() -> list[Figure]:
    """Frame the object in images of 1280 x 720, as the network sees it, on one core."""
    image = np.random.default_rng(0).integers(0, 256, (720, 1280, 3), np.uint8)
    lenses = {'straight': None,
              'with distortion': Distortion('plumb_bob', (-0.18, 0.06, 0.001, -0.0015, 0.0))}
    cameras = {name: orbit_camera(0.7, 0.4, intrinsics=Intrinsics(
        1400, 1400, 643, 358, 1280, 720, bent)) for name, bent in lenses.items()}
    spent = interleaved({
        f'an image of 1280 x 720 framed, lens {name}':
        lambda c=camera: framed_image(image, c, image_size=IMAGE_SIZE)
        for name, camera in cameras.items()})
    return [Figure(name, 'ms', samples, None) for name, samples in spent.items()]


def rendering_of_candidates(side: int) -> Figure:
    """See probabilities of so many cells a side from 24 candidates, on one core: milliseconds."""
    ring = np.stack([orbit_camera(azimuth).pose for azimuth in AZIMUTHS])[None]
    across = (np.arange(side) + 0.5) / side - 0.5
    squares = across[:, None, None] ** 2 + across[:, None] ** 2 + across ** 2
    ball = (1 / (1 + np.exp(40 * (np.sqrt(squares) - 0.35)))).astype(np.float32)[None]
    published = np.where(ball > 0.02, ball, np.float32(0))
    spent = timed_ms(lambda: render_candidates(coarse_volume(published), ring), 200)
    return Figure(f'24 candidates seen in probabilities of {side} cells', 'ms', spent, 5)
