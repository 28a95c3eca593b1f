"""`active-recon train-segmenter`: what of an image is the object, before any background."""

from functools import partial
from pathlib import Path
from typing import Annotated

from active_recon.cli.bf16_option import Bf16, trained_in_bf16
from active_recon.cli.command_line import command_line
from active_recon.cli.one_training import checkpoint_in, resumable, shown_steps
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import read_objects, warn_of_shared_objects
import typer


def train_segmenter(
    data: Annotated[list[Path], typer.Argument(
        help="Folders of training objects in R2N2's layout (see `active-recon dataset build "
             '--cameras any`).')],
    validation: Annotated[Path, typer.Option(
        help='Folder of other objects, on whose silhouettes the result is measured.')],
    out: Annotated[Path, typer.Option(
        help='Folder of the checkpoint, and of the weights at the end.')] = Path('runs/segmenter'),
    init_from: Annotated[str, typer.Option(
        help='A segmenter to begin with, or a lifting network, of whose encoder it takes the way '
             "down. '': fresh weights.")] = 'lifting',
    steps: Annotated[int, typer.Option(min=1, help='Steps.')] = 4000,
    batch_size: Annotated[int, typer.Option(
        min=1, help='Objects of a step, of two images each.')] = 16,
    learning_rate: Annotated[float, typer.Option(help='Peak learning rate.')] = 2e-3,
    warmup_steps: Annotated[int, typer.Option(
        min=1, help='Steps over which the learning rate rises to its peak.')] = 100,
    checkpoint_every: Annotated[int, typer.Option(
        min=1, help='Steps between two checkpoints.')] = 100,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the weights and of the batches.')] = 0,
    bf16: Bf16 = None,
    devices: Annotated[int, typer.Option(
        min=1, help='Processes that share the batches.')] = 1,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads of each process.')] = 2,
    resume: Annotated[bool, typer.Option(
        help='Continue from the checkpoint in the run folder.')] = False,
) -> None:
    """
    Train what finds the object in an image, before any background.

    It serves every network: the nodes and `reconstruct` put the object on white by it with
    `background: segment`. Writes OUT/segmenter.safetensors and its card.

    For example:

      active-recon train-segmenter data/train things/train --validation data/val
    """
    from active_recon.geometry.canonical import NetworkSpec
    from active_recon.models.lifting_encoder import IMAGE_SIZE
    from active_recon.models.segmenter import Segmenter, SegmenterConfig
    from active_recon.models.segmenter_weights import begin_with, save_segmenter
    from active_recon.models.weights_files import find_weights, weights_hash
    from active_recon.training.loop import make_fabric, Run, TrainingConfig
    from active_recon.training.segmenter import train_segmenter
    from active_recon.training.silhouettes import KINDS, silhouette_figures
    from active_recon.volumes.voxels import FINE_RESOLUTION
    import torch

    checkpoint = checkpoint_in(out, resume)
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    half = trained_in_bf16(bf16)
    training = TrainingConfig(steps, batch_size, learning_rate, 1, seed, half, True, 0,
                              warmup_steps, checkpoint_every, validate_every=steps)
    fabric = make_fabric(half, devices)
    fabric.launch()
    spec = NetworkSpec(IMAGE_SIZE, FINE_RESOLUTION, needs_front=False)
    views = read_objects(data, 'training data', spec, at_once=False)
    held_out = read_objects([validation], 'validation data', spec, at_once=False)
    if fabric.is_global_zero:
        warn_of_shared_objects(views.folders, held_out.folders, 'their IoU is too high')
    config = SegmenterConfig()
    segmenter = Segmenter.from_config(config)
    begun_with = ''
    if init_from:
        path = find_weights(init_from)
        begun_with = weights_hash(path)
        begin_with(segmenter, path)
    with resumable(fabric.is_global_zero):
        with shown_steps('segmenter', steps) as report:
            train_segmenter(segmenter, views, training, Run(
                fabric, checkpoint, report, resume, begun_with=begun_with))
        if not fabric.is_global_zero:
            return
        with progress_bar('validation', len(KINDS)) as advance:
            figures = silhouette_figures(segmenter.cpu().eval(), held_out,
                                         advance=partial(advance, 1))
    typer.echo('IoU of silhouettes on validation: '
               + ', '.join(f'{kind} {value:.3f}' for kind, value in figures.items()))
    written = out / 'segmenter.safetensors'
    save_segmenter(written, segmenter, config, {
        'command': command_line(), 'training': training.to_dict(),
        'data': {str(folder): sum(each.root == folder for each in views.folders)
                 for folder in data},
        'validation': figures})
    typer.echo(f'wrote {written}')
