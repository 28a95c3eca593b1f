"""The study of view policies on one frozen network, with random and the greedy oracle."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

from active_recon.config import LossConfig, RewardConfig
from active_recon.evaluation.blocks import run_blocks
from active_recon.evaluation.contenders import heuristic_names
from active_recon.evaluation.policy_study import policy_study, study_contenders
from active_recon.evaluation.statistics import Interval
from active_recon.evaluation.trial import Contender, Trial
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import read_card, weights_hash
from active_recon.paper.claims import all_larger, headroom, larger
from active_recon.paper.plotting import bars, canvas, curves, drawn, Picture
from active_recon.paper.results import Cell, Claim, Column, Result, Table
from active_recon.paper.study import Study
from active_recon.paper.systems import MODEL, policy_training, training_plan, TWO_STAGE
from active_recon.paper.trainings import train_all, Training
from active_recon.paper.writing import provenance
from active_recon.training.loop import TrainingConfig
from active_recon.training.plan import Plan
from torch import nn

_OWN = 'attention'


def weights(study: Study) -> list[Path]:
    """
    Return weights files of policies with several seeds on the study's frozen reconstruction.

    The first is the study's own. Missing ones are trained with the settings of the first.
    """
    first = study.weights
    folder = study.models / 'policies' / weights_hash(first)[:12]
    plan = _plan(study, first) if study.policy_seeds > 1 else None
    return [first, *train_all(study, [Training(
        plan, tuple(study.training_sets()), study.objects('val'), folder / f'seed-{seed}', seed)
        for seed in range(1, study.policy_seeds) if plan])]


def _plan(study: Study, first: Path) -> Plan:
    card = read_card(first).get('policy') or {}
    settings = {each.name: card[each.name] for each in fields(TrainingConfig) if each.name in card}
    rewards = {each.name: card[each.name] for each in fields(RewardConfig) if each.name in card}
    policy = TrainingConfig(**settings) if 'steps' in settings else policy_training(study.samples)
    return Plan(MODEL, TWO_STAGE.size, LossConfig(),
                training_plan(TWO_STAGE, study.samples).reconstruction, policy,
                RewardConfig(**rewards), begun=load_weights(first))


def inputs(study: Study) -> dict[str, Any]:
    """Return the inputs of the study, see `provenance`."""
    return provenance(
        study, {'test': study.objects('test')},
        {f'seed {seed}': path for seed, path in enumerate(weights(study))},
        policy_starts=study.policy_starts, policy_seeds=study.policy_seeds,
        subset_objects=study.subset_objects)


def make(study: Study) -> Result:
    """Measure all policies from the same starts."""
    paths = weights(study)
    trial, attentions = _trial(study, paths)
    if study.crew is not None:
        run_blocks(partial(_prepared, study.elsewhere(), [path.absolute() for path in paths]),
                   trial, study_contenders(trial, attentions, study.policy_seeds), study.crew,
                   [*paths, study.objects('test').root], study.progress)
    found = policy_study(trial, attentions, study.policy_seeds, study.subset_objects,
                         study.progress)
    precision = 'bfloat16' if study.bfloat16 else 'float32'
    text = (
        f'All policies on one frozen network, in {precision}, from {study.policy_starts} first '
        f'views of each of {found["objects"]} parametric test objects. Attention was trained '
        f'under {len(attentions)} seeds{learned_from(paths)}, random drawn under '
        f'{study.policy_seeds}. The greedy oracle knows the truth and takes the view with the '
        'highest IoU after it; it is not a usable policy, but shows the possible '
        'gain. `area` is the mean IoU over the views; differences are paired by object, '
        'start and, where both have as many, seed. Brackets are 95 % intervals over objects, '
        f'starts and seeds. {found["headroom_sentence"]}')
    return Result('View policies on one frozen network', text, _tables(found), claims(found),
                  _picture(found['policies']), found)


def _trial(study: Study, paths: Sequence[Path]) -> tuple[Trial, list[nn.Module]]:
    """Return the trial of the study's network, and the policies that were learned on it."""
    first, *others = [load_weights(path, study.device) for path in paths]
    trial = Trial(first.reconstruction, first.threshold, study.read(study.objects('test')),
                  study.policy_starts, study.views, study.seed, study.bfloat16,
                  cache=study.models / 'measured')
    return trial, [bundle.attention for bundle in (first, *others)
                   if bundle.attention is not None]


def _prepared(study: Study, paths: Sequence[Path]) -> tuple[Trial, list[Contender]]:
    trial, attentions = _trial(study, paths)
    return trial, study_contenders(trial, attentions, study.policy_seeds)


def learned_from(paths: Sequence[Path]) -> str:
    """Return the training data of the policies in words, '' if it is the same for all."""
    first, *others = (' and '.join(read_card(path).get('data') or ()) for path in paths)
    unlike = sorted(set(others) - {first})
    return f' (the first on {first}, others on {", ".join(unlike)})' if unlike else ''


def claims(found: Mapping[str, Any]) -> list[Claim]:
    """Return the claims on the study's figures."""
    verdicts = [headroom(Interval(**found['headroom']))]
    if _OWN in found['policies']:
        above = {name: Interval(**value)
                 for name, value in found['policies'][_OWN]['auc_above'].items()}
        verdicts.append(larger('The attention policy is ahead of random selection',
                               above['random'], 'area, attention minus random'))
        verdicts.append(all_larger(
            'The attention policy is ahead of policies that see nothing',
            {name: value for name, value in above.items() if name != 'random'},
            'area, attention minus the other'))
    lack = found.get('best_subset', {}).get('oracle_lacks')
    if lack:
        verdicts.append(larger('Three views chosen together are better than three chosen greedily',
                           Interval(**lack), 'IoU of the best sequence of three from the same '
                           "start minus the greedy oracle's"))
    return verdicts


def _tables(found: Mapping[str, Any]) -> list[Table]:
    policies = found['policies']
    names = list(policies)
    views = range(len(policies[names[0]]['iou']))
    tables = [Table('IoU over the views', 'policy', names, [
        *(_column(policies, str(view + 1), 'iou', view) for view in views),
        _column(policies, 'area', 'auc')], digits=4)]
    tables.append(Table('What a policy gains, and what it costs', 'policy', names, [
        *(Column(f'area above {other}',
                 [_cell(policies[name]['auc_above'].get(other)) for name in names])
          for other in heuristic_names()),
        Column('share of the gap to the oracle',
               [_cell(policies[name].get('gap_closed')) for name in names]),
        _column(policies, 'rotation, rad', 'rotation'),
        Column('ms to decide', [policies[name]['decision_ms'] for name in names]),
        Column('seeds', [policies[name]['seeds'] for name in names])], digits=4))
    tables += [Table(f'{title} over the views, nats', 'policy', names, [
        _column(policies, str(view + 1), key, view) for view in views], digits=0)
        for title, key in (('Entropy', 'entropy'), ("The paper's entropy", 'paper_entropy'))]
    categories = list(policies[names[0]]['per_category_iou'])
    tables.append(Table('IoU after the last view by category', 'category', categories, [
        Column(name, [_cell(policies[name]['per_category_iou'][category][-1])
                      for category in categories]) for name in names]))
    if 'best_subset' in found:
        tables.append(subset_table(found['best_subset']))
    return tables


def subset_table(subset: Mapping[str, Any]) -> Table:
    """Return a table of the IoU after the best sequence of three views, and of the policies."""
    rows = {'the best sequence of three': subset['best'],
            'the best from the same start': subset['best_from_start'],
            **subset.get('policies', {}),
            'expected at random': subset['expected_at_random']}
    return Table(f'IoU after three views, {subset["objects"]} objects, every sequence tried',
                 'views', list(rows), [Column('IoU', [_cell(value) for value in rows.values()])],
                 digits=4)


def _column(policies: Mapping[str, Any], heading: str, key: str,
            view: int | None = None) -> Column:
    values = [figures[key] if view is None else figures[key][view]
              for figures in policies.values()]
    return Column(heading, [_cell(value) for value in values])


def _cell(value: Mapping[str, float] | None) -> Cell:
    return None if value is None else Interval(**value)


def _picture(policies: Mapping[str, Any]) -> Picture:
    shares = {name: Interval(**figures['gap_closed']) for name, figures in policies.items()
              if figures.get('gap_closed')}
    with canvas(10, 3.6, columns=2 if shares else 1) as (figure, axes):
        lines = {name: [Interval(**value) for value in figures['iou']]
                 for name, figures in policies.items()}
        curves(axes[0][0], range(1, len(next(iter(lines.values()))) + 1), lines, 'views', 'IoU')
        if shares:
            bars(axes[0][1], list(shares), {'share': list(shares.values())},
                 'share of the gap between random and oracle')
        return drawn(figure)
