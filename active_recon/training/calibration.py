"""Calibration of a lifting network, for each number of views."""

from collections.abc import Callable

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.calibration import fit_logistic
from active_recon.models.lifting import Lifting
from active_recon.models.volume_unet import depth_to_space
from active_recon.runtimes.precision import has_bf16
import numpy as np
import torch

MOST_OBJECTS, _BATCH = 104, 4
_CELLS = 20_000  # of each object


@torch.inference_mode()
def calibrate(network: Lifting, validation: ViewSet,
              advance: Callable[[int], None] = lambda done: None) -> None:
    """
    Set the calibration for each number of views, in place; see `Lifting.decode`.

    It is fitted on random cells of up to 104 objects of `validation`, with random views. The
    cells are drawn from the whole grid, not near the surface only, so that confident empty cells
    stay confident. `advance` is called with the number of objects done.
    """
    network.eval()
    in_half = network.device.type == 'cpu' and has_bf16()  # a GPU takes seconds in any case
    rng = np.random.default_rng(0)
    shown = validation.images.shape[1]
    counts = range(1, min(len(network.calibration), shown) + 1)
    inputs: dict[int, list[np.ndarray]] = {count: [] for count in counts}
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
            with torch.autocast('cpu', torch.bfloat16, enabled=in_half):
                state = network.step(
                    validation.white(objects, view).to(network.device),
                    validation.cameras(objects, view).to(network.device), state)
                found = network.logits(state)
            inputs[count].append(np.stack([
                np.take_along_axis(depth_to_space(each.float()).flatten(1).cpu().numpy(), cells,
                                   1).ravel()
                for each in (found.logits, found.evidence)], axis=1))
        advance(min(len(truth) * _BATCH, len(chosen)))
    whole = np.concatenate(truth)
    for count in counts:
        network.calibration[count - 1] = torch.from_numpy(
            fit_logistic(np.concatenate(inputs[count]), whole))
    network.calibration[len(counts):] = network.calibration[len(counts) - 1]
