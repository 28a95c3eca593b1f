"""Trainings of the study's networks, one after another, or each by a worker of a cluster."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from active_recon.cluster.telling import told
from active_recon.errors import ConfigError, WorkError
from active_recon.models.registry import network_entry
from active_recon.models.weights import save_weights
from active_recon.models.weights_files import read_card
from active_recon.paper.study import Objects, Study
from active_recon.reporting import by_step
from active_recon.training.checkpoints import differences
from active_recon.training.loop import make_fabric, Measured, trains_in_bfloat16
from active_recon.training.plan import Plan, Report, seeded, train_plan
from active_recon.training.supervised import mean_length
import torch


@dataclass(frozen=True, eq=False)
class Training:
    """A plan, the objects it is trained and validated on, the folder it is made in, its seed."""

    plan: Plan
    training: tuple[Objects, ...]
    validation: Objects
    out: Path
    seed: int

    @property
    def weights(self) -> Path:
        """Path of the weights that come of it."""
        return self.out / 'weights.safetensors'

    def elsewhere(self) -> 'Training':
        """Return the same training as a worker takes it, which begins in a folder of its own."""
        return replace(self, training=tuple(each.elsewhere() for each in self.training),
                       validation=self.validation.elsewhere(), out=self.out.absolute())


def train_all(study: Study, trainings: Sequence[Training]) -> list[Path]:
    """
    Train what has no weights yet; return the paths of all weights.

    Each goes to a worker of the study's crew, if it has one. An interrupted training continues
    from its checkpoints. Raises ConfigError where weights are there of other objects, samples or
    another seed, and WorkError where a worker's training fails.
    """
    missing = [each for each in trainings if not each.weights.is_file()]
    for each in trainings:
        if each.weights.is_file():
            _require_same(each)
    if study.crew is None:
        for each in missing:
            _train(study, each)
    elif missing:
        train = partial(_train_in_worker, study.elsewhere())
        with study.progress('training', len(missing)) as advance:
            results = study.crew.map(train, [each.elsewhere() for each in missing], study.models,
                                     [study.data])
            for result in told(results, study.crew, advance):
                if result.refusal:
                    raise WorkError(f'{missing[result.index].out}: {result.refusal}', result.kind)
    return [each.weights for each in trainings]


def _require_same(training: Training) -> None:
    """Raise ConfigError where a study's weights are of another training; others may be used."""
    card = read_card(training.weights)
    if not {'objects', 'seed', 'views_seen'} <= card.keys():
        return
    made = {'seed': card['seed'], 'objects': _short(card['objects'])}
    asked = {'seed': training.seed, 'objects': _short(_identities(training.training))}
    plan = training.plan
    if plan.begun is None:  # a frozen network has seen what its own card tells
        made['views_seen'] = card['views_seen']
        asked['views_seen'] = views_seen({
            'model': plan.model, 'scheme': 'joint' if plan.joint else 'two-stage',
            'reconstruction': plan.reconstruction.to_dict()})
    if differing := '; '.join(differences(made, asked)):
        raise ConfigError(f'{training.weights}: of another training: {differing}; name another '
                          'folder with --models')


@cache
def _identities(sets: tuple[Objects, ...]) -> list[dict[str, Any]]:
    return [objects.identity() for objects in sets]


def _short(identities: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the begin of each hash: the folder may be another."""
    return [each['sha256'][:12] for each in identities]


def _train_in_worker(study: Study, training: Training) -> None:
    torch.set_num_threads(study.threads)
    _train(study, training)


def _train(study: Study, training: Training) -> None:
    @contextmanager
    def reporting(stage: str, steps: int) -> Iterator[Report]:
        with study.progress(f'{training.out.name}: {stage}', steps) as advance:
            reached = by_step(advance)

            def report(step: int, measured: Measured) -> None:
                reached(step, f'loss {measured["loss"]:.4f}' if measured else '')

            yield report

    plan, seed = training.plan, training.seed
    bundle = train_plan(
        seeded(plan, seed), study.read(*training.training), study.read(training.validation),
        training.out, reporting, make_fabric(trains_in_bfloat16()), resume=True)
    bundle.card.update(
        command=study.command('systems'), generators_sha256=study.generators(), seed=seed,
        objects=[objects.identity() for objects in training.training],
        views_seen=views_seen({'model': plan.model} | bundle.card))
    save_weights(training.weights, bundle)


def views_seen(card: Mapping[str, Any]) -> int | None:
    """
    Return the number of training views of a reconstruction by its card; None if unknown.

    Those of the weights that its training began with count, too.
    """
    if 'model' in card and network_entry(card['model']).fit:
        return None
    training = card.get('reconstruction') or {}
    if not {'steps', 'batch_size', 'max_views'} <= set(training):
        return None
    length = (training['max_views'] if card.get('scheme') == 'joint'
              else mean_length(training['max_views'], training.get('curriculum_fraction', 0.5)))
    own = int(training['steps'] * training['batch_size'] * length)
    if 'begun_with' not in card:
        return own
    before = views_seen(card['begun_with'])
    return None if before is None else before + own
