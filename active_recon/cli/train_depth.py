"""`active-recon train-depth`: what depth images add to a network that was trained without."""

from pathlib import Path
from typing import Annotated

from active_recon.cli.bf16_option import Bf16, trained_in_bf16
from active_recon.cli.command_line import command_line
from active_recon.cli.one_training import checkpoint_in, resumable, shown_steps
from active_recon.cli.reading import read_objects, warn_of_shared_objects
from active_recon.errors import ConfigError
from active_recon.models.weights_files import DEFAULT_MODEL
import typer


def train_depth(
    data: Annotated[list[Path], typer.Argument(
        help="Folders of training objects in R2N2's layout with depth images (see `active-recon "
             'dataset build --fine --depth`).')],
    validation: Annotated[Path, typer.Option(
        help='Folder of other objects, on which the corrected occupancy is calibrated.')],
    model: Annotated[str, typer.Option(
        help='The network, which stays as it is: a model that ships, or a weights file.'
        )] = DEFAULT_MODEL,
    init_from: Annotated[str | None, typer.Option(
        help='A model that ships, or a weights file: begin with its depth refiner. Default: fresh '
             'weights.')] = None,
    out: Annotated[Path, typer.Option(
        help='Folder of the checkpoint, and of the weights at the end.')] = Path('runs/depth'),
    steps: Annotated[int, typer.Option(min=1, help='Steps.')] = 1500,
    batch_size: Annotated[int, typer.Option(min=1, help='Objects of a step.')] = 8,
    learning_rate: Annotated[float, typer.Option(help='Peak learning rate.')] = 2e-3,
    max_views: Annotated[int, typer.Option(
        min=1, max=8, help='Longest sequence, in views; at most all of an object.')] = 8,
    warmup_steps: Annotated[int, typer.Option(
        min=1, help='Steps over which the learning rate rises to its peak.')] = 100,
    checkpoint_every: Annotated[int, typer.Option(
        min=1, help='Steps between two checkpoints.')] = 100,
    augment: Annotated[bool, typer.Option(
        help='Augment backgrounds, light and poses; --no-augment: plain white.')] = True,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the weights and of the batches.')] = 0,
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    resume: Annotated[bool, typer.Option(
        help='Continue from the checkpoint in the run folder.')] = False,
) -> None:
    """
    Train what depth images add to a lifting network, which stays as it is.

    Simulated depth cameras see the objects with steps, holes, flying pixels and a wrong scale; a
    small network learns to correct the occupancy by what they saw. Without depth it is not run,
    and the network gives what it gave. Writes OUT/<weights>-depth.safetensors and its card: copy
    both beside the network's weights.

    For example:

      active-recon train-depth data/train things/train --validation data/val --out runs/depth
    """
    from active_recon.models.depth_refiner import DepthRefiner, DepthRefinerConfig
    from active_recon.models.depth_weights import load_refiner, save_refiner
    from active_recon.models.lifting import Lifting
    from active_recon.models.weights import load_weights, state_hash
    from active_recon.models.weights_files import depth_path, find_weights, weights_hash
    from active_recon.training.depth import calibrate_depth, train_depth
    from active_recon.training.loop import make_fabric, Run, TrainingConfig
    import torch

    path = find_weights(model)
    network = load_weights(path).reconstruction
    begun = load_refiner(find_weights(init_from)) if init_from else None
    if not isinstance(network, Lifting):
        raise ConfigError(f'--model: no such network: expected lifting, got {model!r}')
    checkpoint = checkpoint_in(out, resume)
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    half = trained_in_bf16(bf16)
    training = TrainingConfig(steps, batch_size, learning_rate, max_views, seed, half, augment, 0,
                              warmup_steps, checkpoint_every, validate_every=steps)
    fabric = make_fabric(half)
    fabric.launch()
    views = read_objects(data, 'training data', network.spec, at_once=False, depth=True)
    held_out = read_objects([validation], 'validation data', network.spec, depth=True)
    warn_of_shared_objects(views.folders, held_out.folders, 'the calibration is biased')
    config = DepthRefinerConfig(features=network.initial_state(1)['coarse_sum'].shape[1])
    refiner = DepthRefiner.begun_with(begun, config) if begun else DepthRefiner.from_config(config)
    begun_with, digest = state_hash(begun) if begun else '', weights_hash(path)
    with resumable(fabric.is_global_zero):
        with shown_steps('depth', steps) as report:
            train_depth(refiner, network, views, training,
                        Run(fabric, checkpoint, report, resume, begun_with=begun_with),
                        {'network_sha256': digest})
        scale, bias = calibrate_depth(refiner.cpu(), network, held_out)
    typer.echo(f'calibrated on validation: {scale:.3f} logit {bias:+.3f}')
    written = out / depth_path(path).name
    save_refiner(written, refiner, config, digest, {
        'command': command_line(), 'training': training.to_dict(),
        'data': {str(folder): sum(each.root == folder for each in views.folders)
                 for folder in data},
        'calibration': [scale, bias]})
    typer.echo(f'wrote {written}')
