"""The compared systems, all trained on the same objects and the same number of views."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from active_recon.config import LossConfig
from active_recon.errors import WeightsError
from active_recon.models.registry import network_entry, NETWORKS
from active_recon.models.weights_files import find_weights, read_card
from active_recon.paper.study import Objects, Study
from active_recon.paper.trainings import train_all, Training, views_seen
from active_recon.training.loop import TrainingConfig
from active_recon.training.plan import Plan
from active_recon.training.supervised import steps_for
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION

BATCH, POLICY_BATCH = 32, 48
LEARNING_RATE, POLICY_LEARNING_RATE = 6e-4, 5e-4
MAX_VIEWS = 5
POLICY_SHARE = 0.4  # training views of a policy, relative to those of its reconstruction
MODEL = '2d3d-attention'


@dataclass(frozen=True)
class System:
    """
    A system to compare: its name on disk, its label in tables, and the settings of its training.

    `model` and `size` are those of the registry; `loss` None is the network's default.
    """

    name: str
    label: str
    model: str
    size: str = 'small'
    joint: bool = False
    policy: bool = False
    loss: LossConfig | None = None

    @property
    def resolution(self) -> int:
        """Resolution of its prediction, cells a side."""
        return FINE_RESOLUTION if self.size.endswith('64') else RESOLUTION


TWO_STAGE = System('two-stage', '2D-3D-attention, two-stage', MODEL, policy=True)
DICE = System('2d3d-dice', '2D-3D, squared error and Dice', MODEL,
              loss=LossConfig(volume_loss='mse+dice'))
JOINT = System('joint', '2D-3D-attention, joint', MODEL, joint=True)
R2N2 = System('r2n2', '3D-R2N2', 'r2n2')
SHAPE_BASIS = System('shape-basis', 'shape basis', 'shape-basis')
SYSTEMS = (
    TWO_STAGE, JOINT, DICE, R2N2, System('ptn', 'PTN', 'ptn'),
    System('ptn-combined', 'PTN, combined', 'ptn-combined'), System('ogn', 'OGN', 'ogn'),
    System('ogn-64', 'OGN at 64', 'ogn', 'small-64'), SHAPE_BASIS)


def systems(study: Study) -> list[System]:
    """Return the systems whose true voxels exist: those at 64 cells need data made with --fine."""
    return [system for system in SYSTEMS if system.model in NETWORKS
            and all(objects.present for objects in (
                *study.training_sets(resolution=system.resolution),
                study.objects('val', resolution=system.resolution),
                study.objects('test', resolution=system.resolution)))]


def find_system(study: Study, system: System) -> Path | None:
    """
    Return a system's weights: those in the study's folder, else those that ship, else None.

    Weights that ship are used only if they were trained on about as many views as the study's, or
    if the system is not trained by steps.
    """
    own = study.models / system.name / 'weights.safetensors'
    if own.is_file():
        return own
    try:
        shipped = find_weights(system.name)
    except WeightsError:
        return None
    if network_entry(system.model).fit:
        return shipped
    seen = views_seen(read_card(shipped))
    return shipped if seen and abs(seen / study.samples - 1) < 0.1 else None


def have_systems(study: Study, wanted: Sequence[System]) -> dict[System, Path]:
    """Return the weights of systems, as `train_all`; those that ship need no training."""
    found = {system: find_system(study, system) for system in wanted}
    own = [system for system, path in found.items()
           if path is None or path.is_relative_to(study.models)]
    trained = dict(zip(own, train_all(study, [training_of(
        system, study.training_sets(resolution=system.resolution),
        study.objects('val', resolution=system.resolution), study.models / system.name,
        study.samples, study.seed) for system in own]), strict=True))
    return {system: path for system in wanted if (path := trained.get(system) or found[system])}


def training_of(system: System, training: Sequence[Objects], validation: Objects, out: Path,
                samples: int, seed: int) -> Training:
    """Return the training of a system on `samples` views."""
    return Training(training_plan(system, samples), tuple(training), validation, out, seed)


def training_plan(system: System, samples: int) -> Plan:
    """Return the plan for training a system on about `samples` views."""
    # In the joint scheme all sequences have the maximum length
    steps = (max(1, round(samples / (BATCH * MAX_VIEWS))) if system.joint
             else steps_for(samples, BATCH, MAX_VIEWS))
    first = TrainingConfig(steps, BATCH, LEARNING_RATE, MAX_VIEWS,
                           warmup_steps=min(200, max(1, steps // 10)))
    policy = policy_training(samples) if system.policy else None
    return Plan(system.model, system.size, system.loss or network_entry(system.model).loss, first,
                policy, joint=system.joint)


def policy_training(samples: int) -> TrainingConfig:
    """Return the training settings of a view policy whose reconstruction had `samples` views."""
    steps = max(1, round(POLICY_SHARE * samples / (POLICY_BATCH * MAX_VIEWS)))
    return TrainingConfig(steps, POLICY_BATCH, POLICY_LEARNING_RATE, MAX_VIEWS, augment=False,
                          warmup_steps=min(20, steps), checkpoint_every=50, validate_every=250)
