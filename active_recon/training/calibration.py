"""Temperature calibration of a lifting network, for each number of views."""

from collections.abc import Callable

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.calibration import fit_temperatures
from active_recon.models.lifting import Lifting
import numpy as np
import torch

MOST_OBJECTS, _BATCH = 64, 4
_CELLS = 20_000  # of each object


@torch.inference_mode()
def calibrate(network: Lifting, validation: ViewSet,
              advance: Callable[[int], None] = lambda done: None) -> dict[int, float]:
    """
    Set the temperature for each number of views, in place; return them.

    They are fitted on random cells of up to 64 objects of `validation`, with random views. The
    cells are drawn from the whole grid, not near the surface only, so that confident empty cells
    stay confident. `advance` is called with the number of objects done.
    """
    network.eval()
    network.temperatures.fill_(1)
    rng = np.random.default_rng(0)
    shown = validation.images.shape[1]
    counts = range(1, min(len(network.temperatures), shown) + 1)
    logits: dict[int, list[np.ndarray]] = {count: [] for count in counts}
    truth: list[np.ndarray] = []
    chosen = np.sort(rng.permutation(len(validation))[:MOST_OBJECTS])
    for objects in torch.split(torch.from_numpy(chosen), _BATCH):
        order = torch.from_numpy(rng.random((len(objects), shown)).argsort(axis=1))
        voxels = validation.voxels[objects].numpy() > 0
        cells = rng.integers(voxels[0].size, size=(len(objects), _CELLS))
        truth.append(np.take_along_axis(voxels.reshape(len(objects), -1), cells, 1).ravel())
        state = network.initial_state(len(objects))
        for count in counts:
            view = order[:, count - 1]
            with torch.autocast('cpu', torch.bfloat16, enabled=network.device.type == 'cpu'):
                state = network.step(validation.white(objects, view),
                                     validation.cameras(objects, view), state)
                found = network.logits(state)[0].float().flatten(1).numpy()
            logits[count].append(np.take_along_axis(found, cells, 1).ravel())
        advance(min(len(truth) * _BATCH, len(chosen)))
    fitted = fit_temperatures({count: np.concatenate(each) for count, each in logits.items()},
                              np.concatenate(truth))
    for count in range(1, len(network.temperatures) + 1):
        network.temperatures[count - 1] = fitted[min(count, max(fitted))]
    return fitted
