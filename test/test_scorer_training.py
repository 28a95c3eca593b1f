"""What a view scorer learns from: measured gains, losses of their order, a calibration."""

from active_recon.datasets.layout import ObjectFolder, RENDERING
from active_recon.errors import ConfigError, DataError
from active_recon.models.candidate_looks import CHANNELS, FACTS, GRID, MOST_VIEWS
from active_recon.models.view_scorer import Looked, ScorerConfig, ViewScorer
from active_recon.training.gain_files import _file, drawn_objects
from active_recon.training.looked import (
    joined,
    looked_states,
    LookedStates,
    mirrored_states,
    spreads,
)
from active_recon.training.loop import TrainingDivergedError
from active_recon.training.scorer import (
    calibrate,
    gap_shares,
    predict,
    ScorerTraining,
    train_scorer,
)
from active_recon.training.scorer_losses import listwise_loss, ordinal_loss, standardised
from active_recon.training.view_gains import spread_views, ViewGains
import numpy as np
import pytest
import torch
from torch.testing import assert_close

SMALL = ScorerConfig(2, 16, 2, 0.0)
SHAPE = (CHANNELS, GRID, GRID, GRID)
LOSSES = [listwise_loss, ordinal_loss]


def some_gains(states=5, candidates=7, seed=0):
    gains = torch.randn(states, candidates, generator=torch.Generator().manual_seed(seed))
    gains[:, 2] = torch.nan
    return gains


def test_gains_are_kept_by_what_an_object_shows(tmp_path):
    folder = ObjectFolder(tmp_path, 'table', 'one')
    folder.images_folder.mkdir(parents=True)
    image = folder.images_folder / '00.png'
    names = []
    for content in (b'one', b'two', b'one'):
        image.write_bytes(content)
        names.append(_file(tmp_path, folder).name)
    folder.depth_path(0).write_bytes(b'depth, which no gain is measured by')
    (folder.images_folder / '.01.png.5f0c12ab.part').write_bytes(b'half an image of a killed run')
    assert names[0] == names[2] == _file(tmp_path, folder).name != names[1]
    assert names[0].startswith('table__one-')


@pytest.mark.parametrize('loss', LOSSES)
def test_a_constant_added_to_all_scores_changes_no_loss(loss):
    gains, scores = some_gains(), some_gains(seed=1).nan_to_num()
    assert_close(loss(scores + 3, gains), loss(scores, gains))


@pytest.mark.parametrize('loss', LOSSES)
def test_scores_in_the_order_of_the_gains_cost_less_than_in_the_reverse(loss):
    gains = some_gains()
    assert (loss(gains.nan_to_num(), gains) < loss(-gains.nan_to_num(), gains)).all()


@pytest.mark.parametrize('loss', LOSSES)
def test_the_score_of_a_view_taken_does_not_count(loss):
    gains, scores = some_gains(), some_gains(seed=1).nan_to_num()
    other = scores.clone()
    other[:, 2] = 50
    assert_close(loss(other, gains), loss(scores, gains))


@pytest.mark.parametrize('loss', LOSSES)
def test_the_order_of_the_candidates_makes_no_difference_to_a_loss(loss):
    gains, scores, order = some_gains(), some_gains(seed=1).nan_to_num(), torch.randperm(7)
    assert_close(loss(scores[:, order], gains[:, order]), loss(scores, gains))


def test_the_listwise_loss_is_zero_at_the_gains_over_the_temperature_alone():
    gains = some_gains()
    exact = (gains / 0.5).nan_to_num()
    assert_close(listwise_loss(exact, gains), torch.zeros(5), atol=1e-5, rtol=0)
    assert (listwise_loss(exact * 1.5, gains) > 1e-3).all()


def test_standardised_gains_have_no_mean_and_the_unit_of_their_number_of_views():
    gains = 0.02 * some_gains() + 0.3
    found = standardised(gains, torch.full((5,), 0.02))
    assert_close(found.nanmean(dim=1), torch.zeros(5), atol=1e-5, rtol=0)
    assert_close(found, some_gains() - some_gains().nanmean(dim=1, keepdim=True), equal_nan=True,
                 atol=1e-4, rtol=0)


def learnable(states=48, candidates=6, seed=0):
    """Return states whose gain is what one of the facts says, a tenth after two views."""
    rng = torch.Generator().manual_seed(seed)
    facts = torch.randn(states, candidates, FACTS, generator=rng)
    views = torch.arange(states) % 2 + 1
    gains = 0.1 * facts[:, :, 3] * torch.where(views == 1, 1, 0.1)[:, None] + 0.05
    gains[:, 0] = torch.nan
    grids = torch.zeros(states, candidates, *SHAPE)
    return LookedStates(Looked(grids, facts, views), gains)


def test_a_gain_that_can_be_seen_is_learned_for_every_number_of_views():
    scorer = train_scorer([learnable()], SMALL, ScorerTraining(epochs=40, batch_size=16))
    shares = gap_shares(scorer, [learnable(seed=1)])
    assert min(shares.values()) > 0.8 and set(shares) == {'all', '1', '2'}


def test_a_training_from_one_seed_ends_the_same():
    one, two = (train_scorer([learnable()], SMALL, ScorerTraining(epochs=2)) for _ in range(2))
    for mine, other in zip(one.parameters(), two.parameters(), strict=True):
        assert_close(mine, other, rtol=0, atol=0)


@pytest.mark.slow
def test_a_training_may_begin_with_a_scorer_which_stays_as_it_is():
    learned = train_scorer([learnable()], SMALL, ScorerTraining(epochs=40, batch_size=16))
    before = {name: tensor.clone() for name, tensor in learned.state_dict().items()}
    short = ScorerTraining(epochs=1, batch_size=16, learning_rate=1e-4)
    further = train_scorer([learnable(seed=3)], SMALL, short, begun=learned)
    assert gap_shares(further, [learnable(seed=1)])['all'] > 0.8 > gap_shares(
        train_scorer([learnable(seed=3)], SMALL, short), [learnable(seed=1)])['all']
    for name, tensor in learned.state_dict().items():
        assert_close(tensor, before[name], rtol=0, atol=0)


def test_a_scorer_of_other_sizes_to_begin_with_is_refused():
    other = ViewScorer.from_config(ScorerConfig(2, 8, 2, 0.0))
    with pytest.raises(ConfigError, match='of other sizes'):
        train_scorer([learnable()], SMALL, ScorerTraining(epochs=1), begun=other)


def test_the_mean_of_calibrated_gains_is_the_mean_of_those_measured():
    scorer = train_scorer([learnable()], SMALL, ScorerTraining(epochs=10))
    states = learnable(seed=2)
    found = calibrate(scorer, [states])
    scores, level = predict(scorer, [states])[0]
    a, b, c = torch.from_numpy(found).float()[states.looked.views - 1].T[..., None]
    expected = a * scores + b * level[:, None] + c
    known = states.gains.isfinite()
    for views in (1, 2):
        own = known & (states.looked.views == views)[:, None]
        assert float(expected[own].mean()) == pytest.approx(float(states.gains[own].mean()),
                                                            abs=1e-5)
    assert (found[:, 0] > 0).all() and (found[2:] == found[1]).all()


def test_no_other_factors_of_score_and_level_are_nearer_to_the_measured_gains():
    scorer = train_scorer([learnable()], SMALL, ScorerTraining(epochs=10))
    states = learnable(states=8, seed=2)
    a, b, c = calibrate(scorer, [states])[0]
    scores, level = predict(scorer, [states])[0]
    known = states.gains.isfinite() & (states.looked.views == 1)[:, None]
    table = [part.double().numpy() for part in (
        scores[known], level[:, None].expand_as(scores)[known], states.gains[known])]

    def apart(scale, of_level):
        rest = table[2] - scale * table[0] - of_level * table[1]
        return rest.var()

    assert c == pytest.approx((table[2] - a * table[0] - b * table[1]).mean())
    for scale in (0.8, 0.9, 0.99, 1.01, 1.1, 1.2):
        assert apart(scale * a, b) > apart(a, b)
        assert apart(a, b + scale - 1) > apart(a, b) or b + scale - 1 < 0


def test_the_spread_of_gains_is_told_by_the_number_of_views():
    found = spreads([learnable(400)], MOST_VIEWS)
    assert found[0] == pytest.approx(0.1, rel=0.15) and found[1] == pytest.approx(0.01, rel=0.15)
    assert (found[2:] == found[1]).all()


def test_states_of_one_number_of_candidates_are_joined():
    sets = joined([learnable(4), learnable(3, 5), learnable(2)])
    assert [(len(each), each.gains.shape[1]) for each in sets] == [(3, 5), (6, 6)]


def measured(seed=0, side=16, views=6):
    """Return gains as they are stored, of cameras around noise."""
    from active_recon.geometry.cameras import orbit_camera

    rng = np.random.default_rng(seed)
    after = rng.random((2, views)).astype(np.float32)
    after[0, 1] = after[1, [1, 4]] = np.nan
    return ViewGains(
        np.array([orbit_camera(azimuth).pose for azimuth in np.arange(views)], np.float32),
        rng.integers(0, 256, (2, side, side, side), np.uint8),
        np.array([[1, -1], [1, 4]], np.int16), rng.random(2).astype(np.float32), after)


def test_gains_come_back_from_their_file_as_they_were(tmp_path):
    gains, path = measured(), tmp_path / 'deep' / 'gains.npz'
    gains.save(path)
    loaded = ViewGains.load(path)
    for name in ('poses', 'occupancy', 'taken', 'iou', 'after'):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(gains, name))
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(DataError, match='no readable gains'):
        ViewGains.load(path)


def test_a_state_shows_its_views_taken_and_all_views_as_candidates():
    gains = measured()
    seen = gains.observation(1)
    np.testing.assert_allclose(seen.taken[0], gains.poses[[1, 4]])
    assert seen.candidates.shape == (1, 6, 4, 4)
    np.testing.assert_allclose(gains.gains[0, 2], gains.after[0, 2] - gains.iou[0])


def test_a_scorer_gives_the_means_of_its_patches_the_scores_of_whole_grids():
    scorer = ViewScorer.from_config(SMALL).eval()
    whole, means = (looked_states(measured(), patches).looked for patches in (GRID, SMALL.patches))
    assert means.grids.shape[-3:] == (SMALL.patches,) * 3
    assert_close(scorer.scores(means), scorer.scores(whole), atol=1e-5, rtol=1e-4)


def test_looked_states_know_their_views_and_mirror_twice_to_themselves():
    states = looked_states(measured())
    assert states.looked.views.tolist() == [1, 2]
    assert states.looked.grids.shape == (2, 6, *SHAPE)
    assert_close(mirrored_states(mirrored_states(states)).looked.grids, states.looked.grids)


@pytest.mark.parametrize(('total', 'count'), [(24, 8), (24, 7), (10, 12)])
def test_some_views_are_drawn_once_each(total, count):
    for seed in range(6):
        drawn = spread_views(total, count, np.random.default_rng(seed))
        assert len(set(drawn)) == len(drawn) == min(total, count)
        assert set(drawn) <= set(range(total))


def test_rounds_go_through_all_objects_in_turn_and_each_has_as_many_as_it_can(tmp_path):
    for number in range(5):
        (tmp_path / RENDERING / 'chair' / f'{number}').mkdir(parents=True)
    first, second, third, whole = (
        [folder.name for folder in drawn_objects(tmp_path, most, number)]
        for most, number in ((2, 1), (2, 2), (2, 3), (7, 2)))
    assert sorted([*first, *second, third[0]]) == ['0', '1', '2', '3', '4']
    assert third[1] == first[0]
    assert sorted(whole) == ['0', '1', '2', '3', '4']


def test_a_training_that_trains_nothing_is_refused():
    with pytest.raises(ConfigError, match='nothing to train'):
        ScorerTraining(epochs=0)
    for rate in (0, -1e-3, float('nan'), float('inf')):
        with pytest.raises(ConfigError, match='invalid learning_rate: expected .* above 0'):
            ScorerTraining(learning_rate=rate)


@pytest.mark.parametrize('steps', range(1, 13))
def test_a_training_may_have_any_number_of_steps(steps):
    train_scorer([learnable(states=2)], SMALL, ScorerTraining(epochs=steps))


def test_a_training_that_diverges_is_refused():
    with pytest.raises(TrainingDivergedError, match='epoch .: the loss is not finite; try a'):
        train_scorer([learnable()], SMALL, ScorerTraining(epochs=8, learning_rate=1e30))
