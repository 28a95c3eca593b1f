"""Fitting and testing the tables of quality: on numbers whose truth is known."""

from dataclasses import fields, replace
import json

from active_recon.cli import quality
from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.datasets.views import read_views
from active_recon.errors import DataError
from active_recon.evaluation.quality import measuring
from active_recon.evaluation.quality.faults import (
    broken_masks,
    FAULTS,
    noise,
    SIZE_FACTOR,
    wrong_poses,
    wrong_size,
)
from active_recon.evaluation.quality.fitting import calibrated, fit
from active_recon.evaluation.quality.measuring import (
    halves,
    LEARNED,
    measure,
    Measured,
    orders_of,
)
from active_recon.evaluation.quality.promises import (
    BROKEN,
    Episodes,
    kept_at_least,
    needed_for,
    NEVER,
)
from active_recon.evaluation.quality.shells import hollow_share
from active_recon.evaluation.quality.study import study
from active_recon.evaluation.quality.summary import markdown
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import SHIPPED, weights_hash
from active_recon.policies import Choice
from active_recon.policies.geometric import HeuristicPolicy
from active_recon.quality.features import FEATURES
from active_recon.quality.tables import Heads, QualityTables, tables_path
from command_line import command, refusal
import numpy as np
import pytest
import torch

COUNTS = 3


def made_up(objects, seed, fault='', noise=0.4, sources=20, kind='random', weights='abc'):
    """Return episodes whose log odds of IoU are a feature's, with noise; faults shift another."""
    rng = np.random.default_rng(seed)
    count = np.tile(np.arange(1, COUNTS + 1), objects)
    item = np.repeat(np.arange(objects), COUNTS)
    numbers = rng.normal(size=(len(count), len(FEATURES)))
    quality = rng.normal(size=objects)[item] + 0.3 * count
    numbers[:, 0] = quality
    iou = 1 / (1 + np.exp(-quality - noise * rng.normal(size=len(count))))
    if fault:
        numbers[:, 1 + list(FAULTS).index(fault)] += 6
    names = np.array([f'{seed}/{each}' for each in item])
    return Measured(
        numbers, rng.normal(size=(len(count), 4)), np.full(len(count), np.nan) if fault else iou,
        np.zeros(len(count)), count, np.array([f'{name} {fault}' for name in names]), names,
        np.array([f'source {each % sources}' for each in item]),
        np.full(len(count), fault, '<U16'), np.full(len(count), kind, '<U16'),
        np.full(len(count), weights))


@pytest.fixture(scope='module')
def tables():
    calibration = [made_up(400, 1), *(made_up(60, 2, fault) for fault in FAULTS)]
    return fit(made_up(400, 0), Measured.joined(calibration), 'abc')


@pytest.fixture(scope='module')
def figures(tables):
    return study(Measured.joined([made_up(400, 3), *(made_up(60, 4, fault) for fault in FAULTS)]),
                 tables)


def test_new_objects_are_above_the_lower_bound_nine_times_in_ten(figures):
    for after in figures['views'].values():
        assert 0.85 < after['solid']['covered'] < 0.95


def test_the_expected_iou_is_off_by_no_more_than_the_noise(figures):
    assert all(after['solid']['error'][0] < 0.09 for after in figures['views'].values())


def test_false_alarms_are_as_rare_as_was_asked_for_and_faults_are_found_and_named(figures):
    assert all(after['flagged'] < 0.08 for after in figures['views'].values())
    for by_count in figures['faults'].values():
        assert all(found['flagged'] > 0.9 and found['named'] > 0.9
                   for found in by_count.values())


def test_promises_that_were_calibrated_are_kept_by_new_objects(figures):
    made = [found for found in figures['promises']['random'].values() if found['stopped']]
    assert len(made) > 2
    assert all(found['kept'] > 1 - BROKEN - 0.04 for found in made)


def measured_four_times(once):
    return Measured.joined([replace(once, episode=np.array([
        f'{name} {seed}' for name in once.episode])) for seed in range(4)])


def test_several_episodes_of_an_object_make_no_interval_narrower(tables):
    once = made_up(60, 3)
    one, other = (study(each, tables) for each in (once, measured_four_times(once)))
    for count, after in one['views'].items():
        assert other['views'][count]['solid']['error'] == pytest.approx(after['solid']['error'])
    assert any(found['change'][0] for found in one['promises']['random'].values())
    for target, found in one['promises']['random'].items():
        assert other['promises']['random'][target]['change'] == pytest.approx(found['change'])
        assert other['promises']['random'][target]['kept_at_least'] == found['kept_at_least']


def test_several_episodes_of_an_object_prove_no_more_than_one(tables):
    few = made_up(60, 1)
    assert calibrated(tables, measured_four_times(few)) == calibrated(tables, few)
    other = replace(few, kind=np.full(len(few), 'even'), episode=np.char.add(few.episode, ' even'))
    both = calibrated(tables, Measured.joined([few, other]))
    assert both.fewest_usual == 2 * 60
    short = replace(few, episode=np.array([f'0 {name}' for name in few.episode]))
    assert calibrated(tables, Measured.joined(
        [short.rows(short.count == 1), few])) == calibrated(tables, few)


def test_objects_of_fewer_views_than_others_count_with_all_of_theirs(tables):
    whole, short = made_up(60, 3), made_up(60, 4)
    short = short.rows(short.count < COUNTS)
    one, other, both = (study(each, tables)['promises']['random'] for each in (
        whole, short, Measured.joined([whole, short])))
    assert any(found['change'][0] for found in both.values())
    for target, found in both.items():
        for name in ('views', 'given_up'):
            assert found[name] == pytest.approx((one[target][name] + other[target][name]) / 2)
        assert found['change'][0] == pytest.approx(
            (one[target]['change'][0] + other[target]['change'][0]) / 2)


def test_views_of_the_learned_policy_have_promises_of_their_own():
    faults = [made_up(60, 2, fault) for fault in FAULTS]
    usual = made_up(400, 1)
    sharper = made_up(400, 5, noise=0.1, kind=LEARNED)
    alone, other, both = (fit(made_up(400, 0), Measured.joined([*parts, *faults]), 'abc')
                          for parts in ([usual], [sharper], [usual, sharper]))
    assert len(alone.needed_learned) == 0
    assert both.needed_learned == other.needed
    assert list(both.needed) == [max(pair) for pair in zip(
        alone.needed, other.needed, strict=True)]
    assert min(both.needed_learned) < min(both.needed)


def test_bounds_hold_in_every_kind_of_views(tables):
    def of(seed, noise, kind):
        drawn = made_up(400, seed, noise=noise, kind=kind)
        return replace(drawn, episode=np.char.add(drawn.episode, kind))

    sure, vague = of(1, 0.2, 'random'), of(5, 1.2, 'even')
    alone = [calibrated(tables, each) for each in (sure, vague)]
    both = calibrated(tables, Measured.joined([sure, vague]))
    for name in ('margin', 'growth'):
        assert getattr(both, name) == [max(pair) for pair in zip(
            *(getattr(each, name) for each in alone), strict=True)]
    after = study(of(6, 1.2, 'even'), both)['views']
    assert all(0.85 < found['solid']['covered'] < 0.95 for found in after.values())
    short = calibrated(tables, Measured.joined([vague, sure.rows(sure.count < COUNTS)]))
    assert short.margin[-1] == alone[1].margin[-1]


def of_any_cameras(measured):
    """Return episodes of any cameras, whose latents are all far from the known ones."""
    kind = np.array([f'{each}, any' for each in measured.kind])
    return replace(measured, kind=kind, latents=measured.latents + 9,
                   episode=np.char.add(measured.episode, ' any'))


@pytest.fixture(scope='module')
def tables_of_both():
    usual = [made_up(400, 1), of_any_cameras(made_up(400, 1))]
    return fit(made_up(400, 0), Measured.joined(
        [*usual, *(made_up(60, 2, fault) for fault in FAULTS)]), 'abc')


def test_false_alarms_are_rare_from_a_turntable_and_from_any_cameras_alike(tables_of_both):
    fresh = made_up(400, 3)
    for views in (fresh, of_any_cameras(fresh)):
        found = study(views, tables_of_both)['views']
        assert all(after['flagged'] < 0.08 for after in found.values())
    moved = replace(fresh, latents=fresh.latents + 9)  # usual from any cameras alone
    found = study(moved, tables_of_both)['views']
    assert [after['flagged'] > 0.9 for after in found.values()] == [False, True, True]


def test_tables_of_any_cameras_alone_judge_all_views_by_them(tables):
    views = of_any_cameras(made_up(400, 1))
    alone = calibrated(tables, views)
    assert not alone.usual_scores_any
    assert study(views, alone)['views']['1']['flagged'] < 0.08 < (
        study(views, tables)['views']['1']['flagged'])


def test_tables_calibrated_on_the_same_objects_are_the_same(tables):
    assert calibrated(tables, made_up(400, 1)) == tables


def test_tables_calibrated_on_other_objects_keep_what_was_fitted_and_bound_those(tables):
    vague = made_up(400, 6, noise=1.2)
    again = calibrated(tables, vague)
    assert all(getattr(again, each.name) == getattr(tables, each.name) for each in fields(Heads))
    after = [study(made_up(400, 7, noise=1.2), each)['views']['2']['solid']['covered']
             for each in (tables, again)]
    assert after[0] < 0.8 and 0.85 < after[1] < 0.95


def test_tables_are_not_calibrated_on_fewer_views_than_they_have(tables):
    few = made_up(40, 1)
    with pytest.raises(DataError, match='after 1 to 3, got none after 3'):
        calibrated(tables, few.rows(few.count < 3))


def test_a_promise_that_is_broken_too_often_is_never_made():
    rng = np.random.default_rng(5)
    expected = rng.uniform(size=(200, 3)).cumsum(axis=1) / 3
    assert needed_for(0.6, Episodes(expected, np.full_like(expected, 0.55))) == NEVER
    assert needed_for(0.6, Episodes(expected, np.full_like(expected, 0.65))) < 0.6


def test_the_same_objects_from_other_cameras_of_a_kind_do_not_replace_those_of_before(tables):
    low, high = made_up(60, 1), replace(made_up(60, 1), iou=np.full(60 * COUNTS, 0.5))
    for use in (lambda both: calibrated(tables, both), lambda both: study(both, tables)):
        with pytest.raises(DataError, match="measured twice: .* got two of '1/0 '; .* --seed"):
            use(Measured.joined([low, high]))


def test_an_episode_stops_at_the_first_view_that_is_enough():
    expected = np.array([[0.2, 0.7, 0.6], [0.1, 0.2, 0.3], [0.9, 0.1, np.nan]])
    episodes = Episodes(expected, np.array([[0.0, 1, 2], [3, 4, 5], [6, 7, 8]]))
    assert episodes.stops(0.55).tolist() == [1, -1, 0]
    assert episodes.stopped(0.55).tolist() == [1, 6]


def test_the_exact_bound_of_a_share_is_missed_as_rarely_as_it_says():
    rng = np.random.default_rng(6)
    bounds = np.array([kept_at_least(kept, 80) for kept in range(81)])
    assert (bounds[rng.binomial(80, 0.9, size=20000)] > 0.9).mean() < 0.055
    assert (np.diff(bounds) > 0).all() and bounds[0] == 0


def test_the_two_halves_share_no_source_and_are_of_like_size():
    measured = made_up(90, 7, sources=7)
    first = halves(measured)
    assert not set(measured.source[first]) & set(measured.source[~first])
    assert 0.35 < first.mean() < 0.65


def test_the_first_half_stays_that_of_before_whatever_else_is_measured():
    measured = made_up(40, 8, sources=7)
    before = ['source 0', 'source 1', 'of others']
    first = halves(measured, before)
    assert set(measured.source[first]) == {'source 0', 'source 1'}
    np.testing.assert_array_equal(halves(measured, ['of others']), halves(measured))


def test_what_was_measured_comes_back_from_its_file(tmp_path):
    measured = made_up(5, 8)
    measured.write(tmp_path / 'm.npz')
    again = Measured.read(tmp_path / 'm.npz')
    assert np.array_equal(again.numbers, measured.numbers)
    assert again.episode.tolist() == measured.episode.tolist()
    whole = (tmp_path / 'm.npz').read_bytes()
    for damaged in (b'no', b'', whole[:len(whole) // 2]):
        (tmp_path / 'm.npz').write_bytes(damaged)
        with pytest.raises(DataError, match='no measured qualities'):
            Measured.read(tmp_path / 'm.npz')


def test_what_was_measured_with_several_networks_is_not_joined():
    measured = made_up(5, 8)
    other = made_up(5, 8, weights='def')
    assert len(Measured.joined([measured, measured])) == 2 * len(measured)
    with pytest.raises(DataError, match='measured with several networks'):
        Measured.joined([measured, other])


def test_without_faults_to_learn_nothing_is_fitted():
    with pytest.raises(DataError, match='no faulty objects'):
        fit(made_up(20, 9), made_up(20, 10), 'abc')


@pytest.mark.filterwarnings('error')
def test_a_fault_that_was_not_measured_is_never_suspected():
    faults = [made_up(60, 2, fault) for fault in FAULTS if fault != 'pose']
    few = fit(made_up(400, 0), Measured.joined([made_up(400, 1), *faults]), 'abc')
    assert few.suspects == tuple(fault for fault in FAULTS if fault != 'pose')
    found = study(Measured.joined([made_up(40, 4, fault) for fault in FAULTS]), few)['faults']
    assert {fault: after['3']['named'] > 0.9 for fault, after in found.items()} == {
        fault: fault != 'pose' for fault in FAULTS}


def test_a_single_known_reconstruction_is_refused():
    known = made_up(1, 0)
    with pytest.raises(DataError, match='a single known reconstruction: expected two or more'):
        fit(known.rows(known.count == 1), Measured.joined(
            [made_up(40, 1), *(made_up(20, 2, fault) for fault in FAULTS)]), 'abc')


def test_known_objects_that_are_all_hollow_are_refused():
    known = made_up(5, 1)
    with pytest.raises(DataError, match='no known solid objects: expected some to fit with'):
        fit(replace(known, hollow=np.ones(len(known))), made_up(5, 2, 'pose'), 'abc')


def test_known_objects_with_faults_are_refused():
    faults = [made_up(20, 2, fault) for fault in FAULTS]
    with pytest.raises(DataError, match='known objects with faults: .* got mask'):
        fit(Measured.joined([made_up(40, 0), made_up(40, 0, 'mask')]),
            Measured.joined([made_up(40, 1), *faults]), 'abc')


def test_known_objects_with_faults_are_told_as_such_where_none_to_calibrate_with_have_any():
    with pytest.raises(DataError, match='with faults: .* got pose; give their files by'):
        fit(made_up(20, 0, 'pose'), made_up(20, 1), 'abc')


def test_a_study_of_hollow_objects_alone_has_no_figures_of_solid_ones(tables):
    hollow = replace(made_up(20, 3), hollow=np.ones(20 * COUNTS))
    found = study(hollow, tables)
    assert found['hollow'] == 20 and not found['promises']
    text = markdown({'command': 'study', 'sets': [{'name': 'shells', **found}]})
    assert '| 3 | 0 | – | – | – |' in text


def test_the_text_has_every_set_and_fault(figures):
    text = markdown({'command': 'c', 'sets': [{'name': 'made up', **figures}]})
    assert all(word in text for word in ('made up', *FAULTS, 'given up'))


def test_a_solid_is_not_hollow_and_a_box_without_a_bottom_is():
    cells = np.zeros((16,) * 3, bool)
    cells[3:13, 3:13, 3:13] = True
    assert hollow_share(cells) == 0
    cells[4:12, 4:12, 3:12] = False
    assert hollow_share(cells) == pytest.approx(576 / 1000)


@pytest.fixture(scope='module')
def seen(tmp_path_factory):
    """Two objects from any cameras."""
    out = tmp_path_factory.mktemp('any')
    jobs = shape_jobs('chair', range(2), out)
    assert not any(each.refusal for each in make_dataset(
        jobs, 1, 1, True, Viewing('any', 4)))
    return read_views([job.folder for job in jobs], resolution=64, image_size=128, framed=True)


def test_every_fault_spoils_the_views_and_leaves_the_truth_and_the_original(seen):
    before = seen.images.clone(), seen.poses.clone()
    for spoil in FAULTS.values():
        spoilt = spoil(seen, 1)
        assert (spoilt.images != seen.images).any() or (spoilt.poses != seen.poses).any()
        assert spoilt.voxels is seen.voxels
    assert (seen.images == before[0]).all() and (seen.poses == before[1]).all()


def test_wrong_poses_are_off_by_the_angle_and_other_faults_keep_the_poses(seen):
    turn = wrong_poses(seen, 1).poses[..., :3, :3] @ seen.poses[..., :3, :3].transpose(-1, -2)
    angle = torch.arccos((turn.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2)
    np.testing.assert_allclose(torch.rad2deg(angle), 20, atol=1e-4)
    for spoil in (noise, broken_masks):
        assert (spoil(seen, 1).poses == seen.poses).all()


def test_a_wrong_size_scales_the_distances_of_the_cameras(seen):
    ratio = wrong_size(seen, 0).poses[..., :3, 3].norm(dim=-1) / seen.poses[..., :3, 3].norm(
        dim=-1)
    np.testing.assert_allclose(ratio[0], 1 / SIZE_FACTOR, rtol=1e-9)
    np.testing.assert_allclose(ratio[1], SIZE_FACTOR, rtol=1e-9)


def test_measured_are_all_objects_after_every_view(seen):
    torch.manual_seed(0)
    network = Lifting.from_config(LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)).eval()
    found = measure(seen, network, 0.1, 3, 'even')
    assert found.count.tolist() == [1, 1, 2, 2, 3, 3]
    assert np.isfinite(found.numbers).all() and ((found.iou >= 0) & (found.iou <= 1)).all()
    assert len(set(found.episode)) == 2
    alone = measure(seen, network, 0.1, 1, 'even')
    np.testing.assert_allclose(alone.numbers, found.numbers[:2], atol=1e-5)
    spoilt = measure(seen, network, 0.1, 2, fault='mask')
    assert np.isnan(spoilt.iou).all() and set(spoilt.fault) == {'mask'}


def test_views_that_are_of_no_turntable_are_of_a_kind_and_of_episodes_of_their_own(seen):
    torch.manual_seed(0)
    network = Lifting.from_config(LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)).eval()
    at_one_height = replace(seen, poses=seen.poses[:, :1].expand_as(seen.poses).contiguous())
    around, everywhere = (measure(views, network, 0.1, 1) for views in (at_one_height, seen))
    assert set(around.kind) == {'random'} and set(everywhere.kind) == {'random, any'}
    assert not set(around.episode) & set(everywhere.episode)


def test_an_object_is_of_its_own_kind_of_views_whatever_is_measured_beside_it(seen):
    torch.manual_seed(0)
    network = Lifting.from_config(LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)).eval()
    poses = seen.poses.clone()
    poses[0] = poses[0, :1]
    found = measure(replace(seen, poses=poses), network, 0.1, 1)
    assert found.kind.tolist() == ['random', 'random, any']
    assert [name.split(' ')[1] for name in found.episode] == ['random', 'random,']


class Recalled(HeuristicPolicy):
    """Takes the views of an order, (N, T)."""

    def __init__(self, order):
        self._order = order

    def choose(self, seen, state):
        wanted = self._order[:, seen.taken.shape[1], None]
        return Choice((np.arange(seen.candidates.shape[1]) == wanted).astype(np.float32)), state


def test_a_policy_chooses_the_views_after_the_first(seen):
    torch.manual_seed(0)
    network = Lifting.from_config(LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)).eval()
    order = orders_of(seen, 'random', 3, 0)
    drawn = measure(seen, network, 0.1, 3)
    same = measure(seen, network, 0.1, 3, 'attention', policy=Recalled(order))
    np.testing.assert_array_equal(same.numbers, drawn.numbers)
    assert set(same.kind) == {'attention, any'}
    other = measure(seen, network, 0.1, 3, 'attention', policy=Recalled(order[:, [0, 2, 1]]))
    at_two = drawn.count == 2
    assert (other.numbers[at_two] != drawn.numbers[at_two]).any()
    np.testing.assert_allclose(other.iou[drawn.count == 3], drawn.iou[drawn.count == 3],
                               atol=1e-6)  # the same views, in another order


def test_no_batch_of_objects_is_measured_by_the_seed_of_another_measurement_s(
        seen, tmp_path, monkeypatch):
    taken = []
    monkeypatch.setattr(quality, '_BATCH', 1)
    monkeypatch.setattr(measuring, 'measure', lambda *told: (
        taken.append(told[6]), made_up(1, len(taken)))[1])
    for seed in (0, 1):
        assert command(monkeypatch, 'quality', 'measure', seen.folders[0].root,
                       tmp_path / 'out.npz', '--views', 2, '--seed', seed, '--threads', 1) == 0
    assert taken[:2] == [0, 1] and len(set(taken)) == 4


def test_the_commands_fit_tables_and_test_them_on_the_other_half(
        tmp_path, monkeypatch, capsys):
    shipped = weights_hash(SHIPPED)
    made_up(200, 0, weights=shipped).write(tmp_path / 'known.npz')
    made_up(200, 1, weights=shipped).write(tmp_path / 'real.npz')
    faults = Measured.joined([made_up(60, 1, fault, weights=shipped) for fault in FAULTS])
    faults.write(tmp_path / 'faults.npz')
    asked = ('quality', 'fit', '--known', tmp_path / 'known.npz', '--calibration',
             tmp_path / 'real.npz', '--out', tmp_path / 'tables.json', '--calibration')
    made_up(60, 1, 'mask', weights=shipped).write(tmp_path / 'one.npz')
    assert command(monkeypatch, *asked, tmp_path / 'one.npz') == 0
    assert 'no objects with the fault unknown, pose, object_size in' in capsys.readouterr().err
    assert command(monkeypatch, *asked, tmp_path / 'faults.npz') == 0
    assert not capsys.readouterr().err
    tables = QualityTables.read(tmp_path / 'tables.json')
    assert tables.weights_sha256 == shipped
    assert command(monkeypatch, 'quality', 'study', tmp_path / 'known.npz', '--halved',
                   tmp_path / 'real.npz', '--halved', tmp_path / 'faults.npz', '--tables',
                   tmp_path / 'tables.json', '--out', tmp_path) == 0
    whole, half = json.loads((tmp_path / 'quality.json').read_text())['sets']
    assert (whole['objects'], half['objects']) == (200, 100)
    used = json.loads((tmp_path / 'tables.json').read_text())['calibrated_on']
    assert not set(used) & set(half['sources'])
    few = Measured.read(tmp_path / 'real.npz')
    few.rows(few.source != half['sources'][0]).write(tmp_path / 'few.npz')
    few.rows(np.isin(few.source, used)).write(tmp_path / 'first.npz')
    asked = ('quality', 'study', '--tables', tmp_path / 'tables.json', '--out', tmp_path,
             '--halved')
    assert command(monkeypatch, *asked, tmp_path / 'few.npz') == 0
    (other,) = json.loads((tmp_path / 'quality.json').read_text())['sets']
    assert other['sources'] == half['sources'][1:]
    assert 'no object of the second half' in refusal(
        monkeypatch, capsys, *asked, tmp_path / 'first.npz')


def test_the_command_calibrates_the_tables_beside_weights_on_objects_of_one_s_own(
        tmp_path, monkeypatch, capsys, tables):
    weights = tmp_path / 'my.safetensors'
    weights.write_bytes(b'of no network')
    sha256 = weights_hash(weights)
    made_up(200, 6, noise=1.2, weights=sha256).write(tmp_path / 'mine.npz')
    asked = ('quality', 'fit', '--calibration', tmp_path / 'mine.npz', '--model', weights)
    assert 'expected its tables in my-quality.json' in refusal(monkeypatch, capsys, *asked)
    earlier = replace(tables, weights_sha256=sha256)
    earlier.write(tables_path(weights), command='fit --known train.npz')
    for _ in range(2):
        assert command(monkeypatch, *asked) == 0
    assert not capsys.readouterr().err
    mine = QualityTables.read(tables_path(weights))
    assert mine.head == list(tables.head) and min(mine.margin) > max(tables.margin)
    card = json.loads(tables_path(weights).read_text())
    assert card['heads_fitted_by'] == 'fit --known train.npz'
    made_up(60, 6, weights=sha256).write(tmp_path / 'mine.npz')
    assert command(monkeypatch, *asked) == 0
    assert 'warning: calibrated on 30 episodes: expected 39 or more' in capsys.readouterr().err


def test_objects_measured_after_too_few_views_are_refused_with_the_number_that_it_takes(
        tmp_path, monkeypatch, capsys, tables):
    weights = tmp_path / 'my.safetensors'
    weights.write_bytes(b'of no network')
    sha256 = weights_hash(weights)
    replace(tables, weights_sha256=sha256).write(tables_path(weights))
    few = made_up(200, 6, weights=sha256)
    few.rows(few.count < COUNTS).write(tmp_path / 'few.npz')
    assert f'got none after {COUNTS}; measure some with `--views {COUNTS}`' in refusal(
        monkeypatch, capsys, 'quality', 'fit', '--calibration', tmp_path / 'few.npz', '--model',
        weights)


def test_what_was_measured_with_another_network_is_refused(tmp_path, monkeypatch, capsys, tables):
    made_up(3, 0).write(tmp_path / 'abc.npz')
    made_up(3, 0, weights='def').write(tmp_path / 'def.npz')
    tables.write(tmp_path / 'tables.json')
    abc, other = tmp_path / 'abc.npz', tmp_path / 'def.npz'
    assert 'with several networks: expected files of one, got weights abc, def' in refusal(
        monkeypatch, capsys, 'quality', 'study', abc, other, '--tables', tmp_path / 'tables.json')
    assert 'with other weights: expected abc, got def' in refusal(
        monkeypatch, capsys, 'quality', 'study', other, '--tables', tmp_path / 'tables.json')
    assert f'with other weights: expected {weights_hash(SHIPPED)[:12]}, got abc' in refusal(
        monkeypatch, capsys, 'quality', 'fit', '--known', abc, '--calibration', abc, '--out',
        tmp_path / 'new.json')
    assert not (tmp_path / 'new.json').exists()
    (tmp_path / 'file').touch()
    assert 'file/new.json: cannot be written' in refusal(
        monkeypatch, capsys, 'quality', 'fit', '--calibration', abc, '--out',
        tmp_path / 'file/new.json')
    monkeypatch.setattr('active_recon.evaluation.quality.study.study', None)  # told before it
    assert 'file/new/quality.json: cannot be written' in refusal(
        monkeypatch, capsys, 'quality', 'study', abc, '--tables', tmp_path / 'tables.json',
        '--out', tmp_path / 'file/new')


def test_a_study_of_nothing_and_an_unknown_fault_are_refused(tmp_path, monkeypatch, capsys):
    assert 'nothing to measure' in refusal(monkeypatch, capsys, 'quality', 'study')
    assert 'unknown value' in refusal(monkeypatch, capsys, 'quality', 'measure', tmp_path,
                                      tmp_path / 'm.npz', '--fault', 'luck')


def test_objects_that_cannot_be_read_are_left_out_by_name(tmp_path, monkeypatch, capsys):
    data, config = tmp_path / 'data', LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)
    list(make_dataset(shape_jobs('lamp', range(5), data), 1, fine=True, viewing=Viewing('any', 2)))
    save_weights(tmp_path / 'lifting.safetensors', Bundle(
        Lifting.from_config(config).eval(), None, config, 0.4, model='lifting'))
    asked = ('quality', 'measure', data, tmp_path / 'm.npz', '--model',
             tmp_path / 'lifting.safetensors', '--views', 1, '--threads', 1)
    *others, last = list_objects(data)
    last.voxels_path(64).unlink()
    assert command(monkeypatch, *asked) == 0
    assert str(last.voxels_path(64)) in capsys.readouterr().err
    assert len(Measured.read(tmp_path / 'm.npz').iou) == 4
    line = refusal(monkeypatch, capsys, *asked, '--views', 3)
    assert '--views: too many: expected at most the 2 of the objects, got 3' in line
    for folder in others:
        folder.voxels_path(64).unlink()
    assert refusal(monkeypatch, capsys, *asked).endswith('expected at least one, got none')


def test_each_object_is_measured_in_its_own_views_however_many_others_have(
        tmp_path, monkeypatch, capsys):
    data, config = tmp_path / 'data', LiftingConfig((8, 8, 8, 8), 8, 8, 4, 4, (8, 8, 8), 8)
    for seeds, views in ((range(2), 6), (range(2, 3), 1), (range(3, 5), 3)):
        list(make_dataset(shape_jobs('lamp', seeds, data), 1, fine=True,
                          viewing=Viewing('any', views)))
    save_weights(tmp_path / 'lifting.safetensors', Bundle(
        Lifting.from_config(config).eval(), None, config, 0.4, model='lifting'))
    asked = ('quality', 'measure', data, tmp_path / 'm.npz', '--model',
             tmp_path / 'lifting.safetensors', '--threads', 1, '--views')
    first, _, few, *_ = list_objects(data)
    own = []
    for views, count in ((2, 2 * 4), (4, 4 * 2)):
        assert command(monkeypatch, *asked, views) == 0
        assert f'{few.images_folder}: too few views: expected {views} or more, got 1' in (
            capsys.readouterr().err)
        found = Measured.read(tmp_path / 'm.npz')
        assert len(found) == count
        own.append(found.rows((found.count == 2) & (found.object == first.full_name)))
        assert len(own[-1]) == 1
    np.testing.assert_allclose(own[0].numbers, own[1].numbers, atol=1e-5)


def test_more_episodes_of_the_same_objects_make_no_narrower_interval(tables):
    once = made_up(200, 3)
    thrice = Measured.joined([
        replace(once, kind=np.full(len(once), kind, '<U16'),
                episode=np.array([f'{name} {kind}' for name in once.episode]))
        for kind in ('random', 'even', LEARNED)])
    for count in map(str, range(1, COUNTS + 1)):
        expected = study(once, tables)['views'][count]['solid']['error']
        assert study(thrice, tables)['views'][count]['solid']['error'] == pytest.approx(expected)


def test_what_is_measured_is_written_whole_where_there_is_no_folder_yet(tmp_path):
    measured = made_up(3, 0)
    path = tmp_path / 'numbers.npz'
    measured.write(path)
    assert [each.name for each in tmp_path.iterdir()] == ['numbers.npz']
    np.testing.assert_array_equal(Measured.read(path).iou, measured.iou)
