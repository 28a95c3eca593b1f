"""A whole training from its plan: reconstruction, threshold, policy; weights with their card."""

from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import Any

from active_recon.config import Config, LossConfig, RewardConfig
from active_recon.datasets.views import ViewSet
from active_recon.errors import ConfigError
from active_recon.evaluation.validation import best_threshold, policy_auc, reconstruction_iou
from active_recon.models.lifting import Lifting
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.registry import network_config, network_entry
from active_recon.models.weights import Bundle, state_hash
from active_recon.policies import learned_policy
from active_recon.runtimes.torch import TorchPolicyRuntime
from active_recon.training.calibration import calibrate, MOST_OBJECTS
from active_recon.training.joint import train_jointly
from active_recon.training.lifting import train_lifting
from active_recon.training.loop import Measured, Run, share_of_batch, TrainingConfig
from active_recon.training.made_objects import MadeObjects
from active_recon.training.policy_gradient import train_policy
from active_recon.training.supervised import train_reconstruction
from lightning_fabric import Fabric
import torch

Report = Callable[[int, Measured], None]
Reporting = Callable[[str, int], AbstractContextManager[Report]]
"""Opens the report of a stage, given its name and its number of steps."""
Show = Callable[[str, int, ReconstructionNetwork], None]
"""Takes a stage's name, the steps done, and the network as it is."""


@dataclass(frozen=True)
class Plan:
    """
    What is trained, and how.

    `policy` None trains no view policy; `joint` trains both together, with the settings of
    `reconstruction`. `begun` are weights whose reconstruction network is used, frozen or as the
    initial weights. `view_separation`, radians, is the smallest angle between the policy's goals
    and the views taken; None is that of `begun`, else 0.
    """

    model: str
    size: str
    loss: LossConfig
    reconstruction: TrainingConfig
    policy: TrainingConfig | None
    rewards: RewardConfig = RewardConfig()
    joint: bool = False
    begun: Bundle | None = None
    frozen: bool = True
    view_separation: float | None = None

    def __post_init__(self) -> None:
        """Reject what cannot be trained together."""
        entry = network_entry(self.model)
        if self.begun and not isinstance(self.begun.config, entry.config):
            raise ConfigError(f'{self.model}: begun with weights of another network: expected '
                              f'those of {self.model}, got those of {self.begun.model}; name it '
                              'by --model')
        if entry.policy is None and (self.joint or self.policy):
            raise ConfigError(f'{self.model}: no view policy in this model: expected one with an '
                              'attentive part; leave the policy out, or train 2d3d-attention')
        if self.joint and self.policy:
            raise ConfigError('two ways to train a policy: expected the joint scheme or a policy '
                              'stage, got both')
        if self.begun and self.frozen and not self.policy:
            raise ConfigError('nothing to train: expected a policy stage on a frozen '
                              'reconstruction, got none')

    @property
    def config(self) -> Config:
        """The sizes of the network, with its policy's view separation."""
        config = self.begun.config if self.begun else network_config(self.model, self.size)
        if self.view_separation is None or not (self.policy or self.joint):
            return config
        if not hasattr(config, 'view_separation'):
            raise ConfigError(f'{self.model}: its policy has no view separation; leave '
                              '--view-separation-deg out')
        return type(config).from_dict(
            {**config.to_dict(), 'view_separation': self.view_separation})


def train_plan(plan: Plan, training: ViewSet | MadeObjects, validation: ViewSet, out: Path,
               reporting: Reporting, fabric: Fabric, resume: bool = False,
               show: Show = lambda stage, step, network: None) -> Bundle:
    """
    Train as planned, with checkpoints of every stage in `out`; return what is to be saved.

    Objects may be made meanwhile for a network that learns from any cameras and has no view
    policy; raises ConfigError for others. The threshold is chosen on validation. With `resume` a
    stage continues from its checkpoint, if there is one. `show` gets the network after every
    validation.
    """
    entry = network_entry(plan.model)
    config = plan.config
    fixed = training if isinstance(training, ViewSet) else None
    if fixed is None and (plan.joint or plan.policy or entry.fit):
        raise ConfigError(f'{plan.model}: objects made while it trains: expected a network that '
                          'learns from any cameras without a view policy, such as lifting; give '
                          'folders of objects')
    network = plan.begun.reconstruction if plan.begun else entry.build(config)
    frozen = plan.begun is not None and plan.frozen
    begun_with = state_hash(network) if plan.begun else ''
    acting = plan.reconstruction if plan.joint else plan.policy
    if acting and acting.max_views < 2:
        raise ConfigError('max_views: nothing to choose: expected 2 or more where a view policy '
                          f'is trained, got {acting.max_views}')
    if acting and (share := share_of_batch(acting, fabric)) % plan.rewards.group_size:
        raise ConfigError('group_size: uneven groups: expected a divisor of the '
                          f'{share} episodes that a process runs at once, got '
                          f'{plan.rewards.group_size}')
    network.requires_grad_(not frozen)
    attention: Any = entry.policy(config) if entry.policy and (plan.joint or plan.policy) else None

    def run(stage: str, report: Report) -> Run:
        return Run(fabric, out / f'{stage}.safetensors', report, resume,
                   show=lambda step: show(stage, step, network), begun_with=begun_with)

    if plan.joint and attention is not None and fixed:
        with reporting('joint', plan.reconstruction.steps) as report:
            train_jointly(network, attention, fixed, plan.reconstruction, plan.loss,
                          plan.rewards, run('joint', report),
                          lambda model, _: reconstruction_iou(model, validation))
    elif entry.fit is not None and fixed:
        entry.fit(network, fixed.voxels, fixed.categories)
    elif isinstance(network, Lifting) and not frozen:
        with reporting('reconstruction', plan.reconstruction.steps) as report:
            train_lifting(network, training, plan.reconstruction, plan.loss,
                          run('reconstruction', report),
                          lambda model: reconstruction_iou(model, validation))
        if fabric.is_global_zero:
            with reporting('calibration', min(MOST_OBJECTS, len(validation))) as report:
                calibrate(network, validation, lambda done: report(done, {}))
        network.calibration.copy_(fabric.broadcast(network.calibration))
    elif not frozen:
        with reporting('reconstruction', plan.reconstruction.steps) as report:
            train_reconstruction(network, training, plan.reconstruction, plan.loss,
                                 run('reconstruction', report),
                                 lambda model: reconstruction_iou(model, validation))
    # By one process: measuring takes memory, which all together may not have
    threshold: float = fabric.broadcast(
        plan.begun.threshold if plan.begun and plan.frozen
        else best_threshold(network, validation) if fabric.is_global_zero else math.nan)
    if plan.policy and attention is not None and fixed:
        with reporting('policy', plan.policy.steps) as report:
            train_policy(network, attention, fixed, threshold, plan.policy, plan.rewards,
                         run('policy', report),
                         lambda model: policy_auc(network, learned_policy(
                             plan.model, TorchPolicyRuntime(model)), validation, threshold))
    return Bundle(network.cpu(), attention and attention.cpu(), config, threshold,
                  _card(plan, training), plan.model)


def _card(plan: Plan, training: ViewSet | MadeObjects) -> dict[str, Any]:
    card = {
        'data': training.card if isinstance(training, MadeObjects) else dict(sorted(
            Counter(str(folder.root) for folder in training.folders).items())),
        'reconstruction': plan.reconstruction.to_dict() | plan.loss.to_dict(),
        'scheme': 'joint' if plan.joint else 'two-stage',
        'policy': plan.policy.to_dict() | plan.rewards.to_dict() if plan.policy else None,
    }
    if plan.begun and plan.frozen:
        kept = plan.begun.card
        card['reconstruction'] = kept.get('reconstruction', {})
        card |= {'begun_with': kept['begun_with']} if 'begun_with' in kept else {}
    elif plan.begun:
        card['begun_with'] = plan.begun.card
    return card


def seeded(plan: Plan, seed: int) -> Plan:
    """Return the plan under another seed, and seed torch's fresh weights with it."""
    torch.manual_seed(seed)
    policy = replace(plan.policy, seed=seed) if plan.policy else None
    return replace(plan, reconstruction=replace(plan.reconstruction, seed=seed), policy=policy)
