"""The compared systems, all trained on the same objects and the same number of views."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from active_recon.config import LossConfig
from active_recon.errors import ConfigError, WeightsError
from active_recon.models.registry import network_entry, NETWORKS
from active_recon.models.weights_files import find_weights, read_card
from active_recon.paper.study import Objects, Study
from active_recon.paper.trainings import train_all, Training, views_seen
from active_recon.training.checkpoints import differences
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
    if the system is not trained by steps. Raises ConfigError where those in the folder are of a
    study of other objects, samples or another seed.
    """
    own = study.models / system.name / 'weights.safetensors'
    if own.is_file():
        _require_same_training(study, system, own)
        return own
    try:
        shipped = find_weights(system.name)
    except WeightsError:
        return None
    if network_entry(system.model).fit:
        return shipped
    seen = views_seen(read_card(shipped))
    return shipped if seen and abs(seen / study.samples - 1) < 0.1 else None


def _require_same_training(study: Study, system: System, own: Path) -> None:
    """Raise ConfigError where a study's training was another one; others' weights may be used."""
    card, plan = read_card(own), training_plan(system, study.samples)
    if not {'objects', 'seed'} <= card.keys():
        return
    made = {'seed': card['seed'], 'views_seen': card.get('views_seen'),
            'objects': tuple(each['sha256'][:12] for each in card['objects'])}
    asked = {'seed': study.seed, 'views_seen': views_seen({
        'model': plan.model, 'scheme': 'joint' if plan.joint else 'two-stage',
        'reconstruction': plan.reconstruction.to_dict()}),
        'objects': _hashes(tuple(study.training_sets(resolution=system.resolution)))}
    if differing := '; '.join(differences(made, asked)):
        raise ConfigError(f'{own}: of another training: {differing}; name another folder with '
                          '--models')


@cache
def _hashes(sets: tuple[Objects, ...]) -> tuple[str, ...]:
    """Return the begin of each set's hash."""
    return tuple(each.identity()['sha256'][:12] for each in sets)


def have_systems(study: Study, wanted: Sequence[System]) -> dict[System, Path]:
    """Return the weights of systems; train those that are missing."""
    found = {system: find_system(study, system) for system in wanted}
    missing = [system for system, path in found.items() if path is None]
    trained = dict(zip(missing, train_all(study, [training_of(
        system, study.training_sets(resolution=system.resolution),
        study.objects('val', resolution=system.resolution), study.models / system.name,
        study.samples, study.seed) for system in missing]), strict=True))
    return {system: path or trained[system] for system, path in found.items()}


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
