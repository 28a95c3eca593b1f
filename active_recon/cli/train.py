"""`active-recon train`: trains networks and policies, with checkpoints and a log."""

from contextlib import ExitStack
from dataclasses import replace
import math
from pathlib import Path
from shlex import quote
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bf16_option import Bf16, trained_in_bf16
from active_recon.cli.command_line import command_line
from active_recon.cli.made_objects import (
    Kept,
    MadeCameras,
    MadeOf,
    MadeOptions,
    make_first,
    MakeProcesses,
    making_told,
    Meshes,
    Uses,
    warn_of_meshes,
)
from active_recon.cli.needed_options import refuse_idle, refuse_lone
from active_recon.cli.one_training import resumable
from active_recon.cli.reading import read_objects, Split, warn_of_shared_objects
from active_recon.errors import ConfigError
from active_recon.whole_files import writable
import typer

if TYPE_CHECKING:
    from active_recon.models.network import ReconstructionNetwork
    from active_recon.models.weights import Bundle


_OF_STEPS = ('steps', 'batch_size', 'learning_rate', 'curriculum_fraction', 'warmup_steps',
             'checkpoint_every', 'validate_every', 'augment')
"""Options of a reconstruction that is trained step by step."""
_OF_POLICY = ('policy_batch_size', 'policy_learning_rate', 'group_size', 'view_separation_deg')
"""Options of a view policy that is trained."""


def train(
    context: typer.Context,
    validation: Annotated[list[Path], typer.Option(
        help='Folder of validation objects, on which the threshold is chosen. May be given '
             'several times.')],
    data: Annotated[list[Path] | None, typer.Argument(
        help="Folders of training objects in R2N2's layout (see `active-recon dataset build`). "
             'Or --make.', show_default=False)] = None,
    split_file: Split = None,
    out: Annotated[Path, typer.Option(
        help='Run folder: checkpoints, TensorBoard log, weights.')] = Path('runs/default'),
    model: Annotated[str, typer.Option(
        help='Network: 2d3d-attention, 2d3d, 2d3d-posed, r2n2, ptn, ptn-combined, ogn, '
             'shape-basis, lifting, carving; the name of one in an installed package; or your own '
             'class, as my_file.py:Net.')] = '2d3d-attention',
    size: Annotated[str | None, typer.Option(
        help="Size of the network: 'small' (the default; an hour on two CPU cores) or "
             "'published' (as in its paper); for ogn also 'small-64' and 'published-64', for "
             "lifting 'large' and 'small-visibility'.")] = None,
    scheme: Annotated[str, typer.Option(
        help="'two-stage': reconstruction on random views, then the policy with it frozen; "
             "'joint': both together on the policy's views, as in the paper.")] = 'two-stage',
    freeze_from: Annotated[str | None, typer.Option(
        help='Weights (or the name of a model that ships) whose reconstruction network is used '
             'frozen: only a policy is trained.')] = None,
    init_from: Annotated[str | None, typer.Option(
        help='Weights (or the name of a model that ships) to initialise the reconstruction '
             'network from; it is trained further.')] = None,
    widen_to: Annotated[str | None, typer.Option(
        help='With --init-from, of lifting: train a network of this larger size, such as large, '
             'which at first gives nearly what the given weights give.')] = None,
    steps: Annotated[int, typer.Option(
        min=1, help='Training steps of the reconstruction.')] = 12000,
    policy_steps: Annotated[int, typer.Option(
        min=0, help='Training steps of the view policy; 0: no policy.')] = 120,
    batch_size: Annotated[int, typer.Option(min=1, help='Objects in a batch.')] = 32,
    policy_batch_size: Annotated[int, typer.Option(min=2, help='Episodes in a batch.')] = 96,
    learning_rate: Annotated[float, typer.Option(
        help='Peak learning rate; it decays by half a cosine.')] = 1e-3,
    policy_learning_rate: Annotated[float, typer.Option(
        help='Peak learning rate of the policy.')] = 1e-3,
    group_size: Annotated[int | None, typer.Option(
        min=1, help="Episodes with the same start; each one's baseline includes the mean return "
                    'of the others. Default: 6; 1, as in the paper, if joint.')] = None,
    view_separation_deg: Annotated[float | None, typer.Option(
        min=0, max=180, help='Smallest angle between a goal and the views taken, degrees. '
                             'Default: 60; 0, as in the paper, if joint.')] = None,
    max_views: Annotated[int, typer.Option(
        min=1, max=24, help='Longest training sequence, in views; at most all of an object.')] = 5,
    curriculum_fraction: Annotated[float, typer.Option(
        help='Fraction of the steps, at the start, with sequences of at most two views.')] = 0.5,
    volume_loss: Annotated[str | None, typer.Option(
        help="Volume loss: mse (the paper's), bce, dice, mse+dice, bce+dice; default: depends on "
             'the network.')] = None,
    volume_weight: Annotated[float | None, typer.Option(
        help="Weight of the volume loss, the paper's lambda_V (section 3.2); default: depends on "
             'the network.')] = None,
    silhouette_weight: Annotated[float | None, typer.Option(
        help="Weight of the silhouette loss, the paper's lambda_S; default: depends on the "
             'network.')] = None,
    warmup_steps: Annotated[int, typer.Option(
        min=1, help='Steps over which the learning rate rises to its peak.')] = 200,
    checkpoint_every: Annotated[int, typer.Option(
        min=1, help='Steps of the reconstruction between two checkpoints.')] = 200,
    validate_every: Annotated[int, typer.Option(
        min=1, help='Steps of the reconstruction between two validations.')] = 500,
    augment: Annotated[bool, typer.Option(
        help='Augment backgrounds, light, shift and scale; --no-augment: plain white, as in the '
             'paper.')] = True,
    make: MakeProcesses = None,
    meshes: Meshes = None,
    made_of: MadeOf = None,
    made_cameras: MadeCameras = None,
    uses: Uses = 6,
    kept: Kept = 2000,
    seed: Annotated[int, typer.Option(
        min=0, help='Seed of the weights, of the batches and of what --make makes.')] = 0,
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads of each process.')] = 2,
    devices: Annotated[int, typer.Option(
        min=1, help='Number of GPUs of each machine, or of processes without a GPU.')] = 1,
    nodes: Annotated[int, typer.Option(
        min=1, help='Number of machines. Start the command on each, with the variables '
                    'MASTER_ADDR, MASTER_PORT and NODE_RANK of Lightning Fabric, or by '
                    'torchrun.')] = 1,
    resume: Annotated[bool, typer.Option(
        help='Continue from the checkpoints in the run folder.')] = False,
) -> None:
    """
    Train a reconstruction network, and a view policy for it; write weights that load.

    The reconstruction learns from random views under the weighted volume and silhouette losses;
    the policy then learns by policy gradient with the reconstruction frozen, or both learn
    together (--scheme joint). Ctrl-C saves a checkpoint; --resume continues an interrupted
    training. The weights are written to OUT/weights.safetensors, with their card beside them.

    Objects that are made while it trains, on a machine with 16 cores and a graphics card:

      active-recon train --make 8 --validation data/val --model lifting --batch-size 96
    """
    from active_recon.cli.training_log import SummaryLog
    from active_recon.config import LossConfig, RewardConfig
    from active_recon.datasets.views import ViewSet
    from active_recon.models.registry import (
        named_network,
        network_entry,
        NETWORKS,
        OWN_NETWORKS,
    )
    from active_recon.models.trial import built_and_tried
    from active_recon.models.weights import save_weights
    from active_recon.models.weights_files import find_weights
    from active_recon.shapes import generators_hash
    from active_recon.training.loop import make_fabric, TrainingConfig
    from active_recon.training.made_objects import MadeObjects
    from active_recon.training.plan import Plan, train_plan
    import torch

    if scheme not in ('two-stage', 'joint'):
        raise ConfigError("--scheme: unknown scheme: expected 'two-stage' or 'joint', got "
                          f'{scheme!r}')
    begun_here = [*(file for stage in ('reconstruction', 'policy', 'joint', 'weights')
                    if (file := out / f'{stage}.safetensors').exists()),
                  *(out / 'tensorboard').rglob('events.*')]
    if not resume and begun_here:
        raise ConfigError(f'{out}: holds another training ({begun_here[0].name}); continue it '
                          'with --resume, or name another folder with --out')
    if bool(data) == (make is not None):
        raise ConfigError('training objects: expected folders of them, or --make to make them '
                          f'during the training, got {"both" if data else "neither"}')
    refuse_lone(context, '--make', make is not None, 'uses', 'kept')
    making = MadeOptions(make or 0, meshes, made_of, made_cameras, uses, kept)
    if freeze_from and init_from:
        raise ConfigError('both --freeze-from and --init-from: give one of them')
    if widen_to and not init_from:
        raise ConfigError('--widen-to without --init-from: expected weights to begin with')
    refuse_idle(context, 'with --freeze-from, whose reconstruction is not trained',
                freeze_from is not None, *_OF_STEPS, 'volume_loss', 'volume_weight',
                'silhouette_weight')
    joint = scheme == 'joint'
    refuse_idle(context, 'with --scheme joint', joint, 'curriculum_fraction', 'policy_steps',
                'policy_batch_size', 'policy_learning_rate')
    begun = freeze_from or init_from
    own_file, model = model, named_network(model)
    entry = network_entry(model)
    refuse_idle(context, f'with {model}, which learns all at once', entry.fit is not None,
                *_OF_STEPS, 'max_views')
    no_policy = ('with --policy-steps 0, which trains no view policy' if entry.policy else
                 f'with {model}, which has no view policy')
    refuse_idle(context, no_policy, not (joint or entry.policy and policy_steps), *_OF_POLICY)
    refuse_idle(context, no_policy, entry.policy is None and policy_steps > 0, 'policy_steps')
    loss = LossConfig(
        entry.loss.volume_weight if volume_weight is None else volume_weight,
        entry.loss.silhouette_weight if silhouette_weight is None else silhouette_weight,
        volume_loss or entry.loss.volume_loss)
    half = trained_in_bf16(bf16)
    first = TrainingConfig(steps, batch_size, learning_rate, max_views, seed, half, augment,
                           curriculum_fraction, warmup_steps, checkpoint_every, validate_every)
    second = TrainingConfig(
        max(policy_steps, 1), policy_batch_size, policy_learning_rate, max_views, seed, half,
        augment=False, warmup_steps=20, checkpoint_every=50, validate_every=250)
    if group_size is None:
        group_size = 1 if joint else 6
    if view_separation_deg is None:
        view_separation_deg = 0 if joint else 60
    with_policy = entry.policy is not None and not joint and policy_steps > 0
    if begun and size is not None:
        raise ConfigError(f'--size: {size} with given weights: expected none, since it is that of '
                          'the weights; --widen-to makes a lifting network larger')
    plan = Plan(model, size or 'small', loss, first, second if with_policy else None,
                RewardConfig(group_size=group_size), joint,
                begun=_begun(find_weights(begun), model, widen_to) if begun else None,
                frozen=init_from is None, view_separation=math.radians(view_separation_deg))
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    fabric = make_fabric(half, devices, nodes)
    fabric.launch()
    network = (entry.build(plan.config) if model in NETWORKS
               else built_and_tried(entry, plan.config, own_file))
    _refuse_unused({'--volume-weight': volume_weight, '--silhouette-weight': silhouette_weight,
                    '--volume-loss': volume_loss}, model, network)
    asked = network.spec
    weights = writable(out / 'weights.safetensors')  # tells before data are read
    with ExitStack() as stack:
        if data:
            training: ViewSet | MadeObjects = read_objects(
                data, 'training data', asked, split_file, 'train', at_once=False)
        else:
            training = stack.enter_context(making.objects(
                asked, first, fabric.global_rank, fabric.world_size))
            make_first(training, out / 'reconstruction.safetensors' if resume else None)
        held_out = read_objects(validation, 'validation data', asked, split_file, 'val')
        if isinstance(training, MadeObjects):
            warn_of_meshes(training, held_out.folders)
        elif fabric.is_global_zero:
            warn_of_shared_objects(training.folders, held_out.folders,
                                   'the threshold is biased, and their IoU is too high')
        log = stack.enter_context(SummaryLog(out / 'tensorboard', held_out))
        with resumable(fabric.is_global_zero):
            bundle = train_plan(plan, training, held_out, out, log.reporting, fabric, resume,
                                log.show)
        if isinstance(training, MadeObjects) and fabric.is_global_zero:
            typer.echo(making_told(training))
    if fabric.is_global_zero:
        bundle.card.update(command=command_line(),
                           generators_sha256=generators_hash())
        save_weights(weights, bundle)
        chosen = f'that of {freeze_from}' if freeze_from else 'chosen on validation'
        typer.echo(f'threshold {bundle.threshold:.2f}, {chosen}\nwrote {weights} and its card')
        if own_file != model:
            typer.echo(f'they load where {OWN_NETWORKS}={quote(own_file)} is set')


def _refuse_unused(losses: dict[str, object], model: str,
                   network: 'ReconstructionNetwork') -> None:
    """Raise ConfigError on an option of the losses, not None, that has no effect on a network."""
    from active_recon.models.lifting import Lifting
    from active_recon.models.network import ReconstructionNetwork
    from active_recon.models.registry import network_entry

    if isinstance(network, Lifting):
        unused = {'--volume-weight', '--silhouette-weight'}
    elif network_entry(model).fit or (
            type(network).objective is not ReconstructionNetwork.objective):
        unused = set(losses)
    else:
        return
    for option, value in losses.items():
        if value is not None and option in unused:
            raise ConfigError(f'{option}: no effect: expected none, since {model} learns by a way '
                              f'of its own, got {value}; leave it out')


def _begun(path: Path, model: str, widen_to: str | None) -> 'Bundle':
    from active_recon.models.lifting import LiftingConfig
    from active_recon.models.registry import network_config
    from active_recon.models.weights import load_weights
    from active_recon.models.weights_files import read_card
    from active_recon.models.widening import widened

    bundle = replace(load_weights(path), card=read_card(path))
    if widen_to is None:
        return bundle
    sizes = network_config(model, widen_to)
    if not isinstance(sizes, LiftingConfig):
        raise ConfigError(f'--widen-to: {model} cannot be widened: expected --model lifting')
    return widened(bundle, sizes)
