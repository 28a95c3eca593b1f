"""Objects a second of an evaluation, in torch and in exported graphs, on two threads."""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs, Viewing
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.exported_network import network_in
from active_recon.evaluation.posed.scene import read_scene
from active_recon.evaluation.rollouts import Observer
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import SHIPPED
from benchmarks.figures import Figure, interleaved
import numpy as np
import torch

_OBJECTS, _VIEWS, _THREADS, _TURNS = 4, 5, 2, 3


def evaluation_figures() -> list[Figure]:
    """Measure four chairs after each of five views, with the default network."""
    torch.set_num_threads(_THREADS)
    bundle = load_weights(SHIPPED)
    with TemporaryDirectory() as folder:
        list(make_dataset(shape_jobs('chair', range(_OBJECTS), Path(folder)), 1, fine=True,
                          viewing=Viewing('any', _VIEWS)))
        views = read_scene(list_objects(Path(folder)), [bundle.reconstruction]).views
    found = interleaved({
        f'{runtime}, {"bf16" if half else "f32"}': partial(
            _measure, network_in(runtime, SHIPPED, bundle, half, _THREADS), views, half)
        for half in (False, True) for runtime in ('torch', 'openvino')}, _TURNS)
    rates = {name: _OBJECTS * 1e3 / np.array(samples) for name, samples in found.items()}
    return [*(Figure(f'evaluation, {name}', 'objects/s', samples, None, more_is_better=True)
              for name, samples in rates.items()),
            *(Figure(f'evaluation, openvino beside torch, {precision}', 'times',
                     rates[f'openvino, {precision}'] / rates[f'torch, {precision}'], 3,
                     more_is_better=True) for precision in ('f32', 'bf16'))]


@torch.inference_mode()
def _measure(network: ReconstructionNetwork, views: ViewSet, half: bool) -> None:
    observer, objects = Observer(network, views, half), torch.arange(len(views))
    state = observer.initial_state(len(views))
    for view in range(_VIEWS):
        state = observer.update(objects, torch.full_like(objects, view), state)
        observer.occupancy(state)
