"""What the paper's document says follows from the numbers: either way, and in between."""

from active_recon.evaluation.statistics import Interval
from active_recon.paper import figures, policies, published, table1, table2, table4, table5
from active_recon.paper.claims import (
    all_larger,
    best,
    FAILS,
    headroom,
    HOLDS,
    larger,
    OPEN,
    reaches,
)
from active_recon.paper.comparison import same_training
from active_recon.paper.measured import Measured
from active_recon.paper.spreads import unweighted
from active_recon.paper.table3 import best_categories, category_table, UNWEIGHTED, WEIGHTED
import numpy as np
import pytest

ABOVE, BELOW, AROUND = (Interval(0.02, 0.01, 0.03), Interval(-0.02, -0.03, -0.01),
                        Interval(0.0, -0.01, 0.01))


def measured(ious, categories=None, entropy=None):
    ious = np.asarray(ious, float)
    entropy = np.zeros_like(ious) if entropy is None else np.asarray(entropy, float)
    names = np.array(categories or ['lamp'] * len(ious))
    return Measured(ious, entropy, entropy / 2, names)


def noise(seed, size=(40, 4, 5)):
    return np.random.default_rng(seed).normal(0, 0.01, size)


@pytest.mark.parametrize(('difference', 'verdict', 'words'), [
    (ABOVE, HOLDS, 'above 0'), (BELOW, FAILS, 'not above 0'), (AROUND, OPEN, '0 inside')])
def test_a_difference_decides_by_its_whole_interval(difference, verdict, words):
    claim = larger('A is ahead of B', difference, 'A minus B')
    assert claim.verdict == verdict
    assert words in claim.because
    assert f'{difference.mean:.4f}' in claim.because


@pytest.mark.parametrize(('third', 'verdict'), [(ABOVE, HOLDS), (BELOW, FAILS), (AROUND, OPEN)])
def test_one_difference_among_several_decides_for_all_and_is_named(third, verdict):
    claim = all_larger('ahead everywhere', {'1': ABOVE, '2': ABOVE, '3': third}, 'A minus B')
    assert claim.verdict == verdict
    assert verdict == HOLDS or '3 (' in claim.because


@pytest.mark.parametrize(('gap', 'verdict'), [(ABOVE, HOLDS), (BELOW, FAILS), (AROUND, OPEN)])
def test_the_best_is_ahead_of_every_other(gap, verdict):
    claim = best('A is the best', 'A', {'B': ABOVE, 'C': gap}, 'test')
    assert claim.verdict == verdict
    assert verdict == HOLDS or 'C' in claim.because


@pytest.mark.parametrize(('mean', 'verdict'), [(0.46, HOLDS), (0.44, FAILS)])
def test_an_aim_is_reached_or_missed_by_so_much(mean, verdict):
    claim = reaches('IoU of 0.45', Interval(mean, mean - 0.02, mean + 0.02), 0.45)
    assert claim.verdict == verdict
    assert ('missed by 0.010' in claim.because) == (verdict == FAILS)


@pytest.mark.parametrize(('difference', 'verdict'), [
    (Interval(0.004, 0.003, 0.005), FAILS), (Interval(0.02, 0.01, 0.03), HOLDS),
    (Interval(0.02, -0.01, 0.05), OPEN)])
def test_a_headroom_under_five_thousandths_is_said(difference, verdict):
    claim = headroom(difference)
    assert claim.verdict == verdict
    assert ('under 0.005' in claim.because) == (verdict == FAILS)


def four_rows(joint_gain, choice_gain):
    """Return table 1's rows where training and choice gain so much."""
    base = 0.5 + noise(0)
    chosen = np.array([0, 1, 1, 1, 1]) * choice_gain
    rows = (base, base + chosen, base + joint_gain, base + joint_gain + chosen)
    return {name: measured(values + noise(seed) / 10)
            for seed, (name, values) in enumerate(zip(table1.ROWS, rows, strict=True), 1)}


def test_the_effect_of_training_and_of_choice_are_told_apart():
    def verdicts(*gains):
        found = {claim.claim: claim.verdict for claim in table1.claims(four_rows(*gains))}
        return [verdict for words in ('at a single view', 'on the two-stage network')
                for claim, verdict in found.items() if words in claim]
    assert verdicts(0.06, 0.0)[0] == HOLDS
    assert verdicts(0.06, 0.0)[1] != HOLDS
    assert verdicts(-0.06, 0.02) == [FAILS, HOLDS]


def test_what_is_chosen_cannot_help_at_a_single_view():
    rows = {name: measured(found.iou[..., :1]) for name, found in four_rows(0.1, 0.1).items()}
    choices = [claim for claim in table1.claims(rows) if 'choice of views' in claim.claim]
    assert [claim.verdict for claim in choices] == [OPEN, OPEN]


@pytest.mark.parametrize(('gain', 'verdict'), [(0.05, HOLDS), (-0.05, FAILS)])
def test_the_papers_pair_of_weights_is_the_best_or_not(gain, verdict):
    values = {pair: 0.4 + noise(seed, (30, 4)) for seed, pair in enumerate(published.TABLE2)}
    values[0.4, 0.6] = values[0.4, 0.6] + gain
    assert table2.claims(values)[0].verdict == verdict


@pytest.mark.parametrize(('gain', 'verdict'), [(0.05, HOLDS), (-0.05, FAILS)])
def test_silhouettes_or_volume_weigh_more(gain, verdict):
    values = {(volume, outline): 0.4 + noise(0, (30, 4)) + gain * (outline > volume)
              for volume, outline in published.TABLE2}
    assert table2.claims(values)[1].verdict == verdict


def test_most_categories_are_more_than_half():
    names = np.array(['car', 'lamp', 'sofa'])
    ahead = {'ours': np.array([[0.8], [0.4], [0.6]]), 'theirs': np.array([[0.7], [0.5], [0.5]])}
    assert best_categories(ahead, names).verdict == HOLDS
    assert 'theirs in lamp' in best_categories(ahead, names).because
    assert best_categories(dict(reversed(ahead.items())), names).verdict == FAILS


def test_weighted_and_unweighted_means_differ_where_categories_have_other_sizes():
    names = np.array(['car', 'car', 'car', 'lamp'])
    values = np.array([[0.9], [0.9], [0.9], [0.1]])
    table = category_table({'ours': values}, names)
    cells = dict(zip(table.rows, table.columns[0].cells, strict=True))
    assert cells[UNWEIGHTED].mean == pytest.approx(0.5)
    assert cells[WEIGHTED].mean == pytest.approx(0.7)
    assert cells['car'].mean == pytest.approx(0.9)
    assert unweighted(values, names) == cells[UNWEIGHTED]


def test_an_unweighted_interval_holds_its_mean_and_shrinks_to_nothing_where_all_are_alike():
    names = np.array(['car', 'lamp'] * 30)
    values = 0.5 + noise(3, (60, 2))
    found = unweighted(values, names)
    assert found.low < found.mean < found.high
    assert unweighted(np.full((60, 2), 0.5), names) == Interval(0.5, 0.5, 0.5)


@pytest.mark.parametrize(('last', 'verdict', 'reached'), [
    (0.5, HOLDS, HOLDS), (0.3, FAILS, FAILS)])
def test_unseen_categories_rise_with_the_views_and_reach_the_aim(last, verdict, reached):
    ious = 0.4 + noise(1, (30, 2, 5))
    ious[..., -1] = last + noise(2, (30, 2))
    names = ['bed', 'bookshelf', 'motorbike'] * 10
    claims = table5.claims('unseen', {'attention': measured(ious, names)})
    assert [claim.verdict for claim in claims[:2]] == [verdict, reached]


@pytest.mark.parametrize(('bed', 'verdict'), [(0.1, HOLDS), (0.7, FAILS)])
def test_the_poorest_category_is_the_one_of_the_lowest_mean(bed, verdict):
    ious = np.full((3, 2, 5), 0.5)
    ious[0] = bed
    found = measured(ious, ['bed', 'bookshelf', 'motorbike'])
    assert table5.claims('unseen', {'attention': found})[2].verdict == verdict


@pytest.mark.parametrize(('fall', 'verdict'), [(300, HOLDS), (-300, FAILS)])
def test_entropy_falls_more_under_one_policy_or_the_other(fall, verdict):
    entropy = 3000 + 100 * noise(4, (30, 2, 5))
    lower = entropy - fall * np.arange(5)
    found = {'attention': measured(np.zeros((30, 2, 5)), entropy=lower),
             'random': measured(np.zeros((30, 2, 5)), entropy=entropy)}
    assert [claim.verdict for claim in figures.claims9(found)][:2] == [verdict, verdict]


@pytest.mark.parametrize(('more', 'verdicts'), [
    (0.1, [HOLDS, HOLDS]), (0.0, [FAILS, HOLDS]), (2.0, [HOLDS, FAILS])])
def test_time_grows_with_the_views_slightly_or_not(more, verdicts):
    runs = np.abs(noise(5, (12, 1))) + 1 + more * np.arange(5)
    assert [claim.verdict for claim in figures.claims10(runs)] == verdicts


def test_the_order_of_the_steps_is_the_papers_or_told():
    seconds = {step: Interval(value, value, value)
               for step, (value, _) in published.TABLE4.items()}
    assert table4.claim(seconds).verdict == HOLDS
    other = seconds | {'making prediction': Interval(9, 9, 9)}
    assert table4.claim(other).verdict == FAILS
    assert 'Measured order: making prediction' in table4.claim(other).because


@pytest.mark.parametrize(('gain', 'verdict'), [(ABOVE, HOLDS), (BELOW, FAILS), (AROUND, OPEN)])
def test_attention_is_compared_with_chance_and_with_who_sees_nothing(gain, verdict):
    gain = vars(gain)
    found = {'headroom': vars(ABOVE), 'policies': {'attention': {
        'auc_above': {'random': gain, 'uniform': gain, 'farthest': gain}}}}
    assert [claim.verdict for claim in policies.claims(found)] == [HOLDS, verdict, verdict]


def test_the_best_sequences_stand_beside_what_the_policies_reached():
    subset = {'objects': 60, 'best': vars(ABOVE), 'best_from_start': vars(AROUND),
              'expected_at_random': vars(BELOW), 'policies': {'oracle': vars(AROUND)},
              'oracle_lacks': vars(ABOVE)}
    table = policies.subset_table(subset)
    assert table.rows == ['the best sequence of three', 'the best from the same start', 'oracle',
                          'expected at random']
    assert table.columns[0].cells == [ABOVE, AROUND, AROUND, BELOW]
    found = {'headroom': vars(ABOVE), 'policies': {}, 'best_subset': subset}
    assert [claim.verdict for claim in policies.claims(found)] == [HOLDS, HOLDS]


def card(steps, data='a', **more):
    return {'model': 'r2n2', 'data': {data: 6}, **more,
            'reconstruction': {'steps': steps, 'batch_size': 32, 'max_views': 5}}


@pytest.mark.parametrize(('cards', 'verdict'), [
    ([card(100), card(105)], HOLDS),
    ([card(100), card(45, scheme='joint')], HOLDS),  # its sequences are all the longest
    ([card(100), card(200)], FAILS),
    ([card(100), card(100, 'b')], FAILS),
    ([{}, {}], FAILS)])
def test_systems_that_learned_from_other_objects_or_views_are_told(cards, verdict):
    claim = same_training({str(index): each for index, each in enumerate(cards)})
    assert claim.verdict == verdict
