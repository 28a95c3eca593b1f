"""Networks measured on posed views: what is said of them, beside each other and disturbed."""

from dataclasses import replace
from functools import cache
import json
import math
from shutil import copytree

from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import ConfigError, DataError, WeightsError
from active_recon.evaluation.posed import robustness
from active_recon.evaluation.posed.choosing import choose
from active_recon.evaluation.posed.entrants import Entrant, load_entrants
from active_recon.evaluation.posed.measuring import logits_of, measure, orders_of, Plan
from active_recon.evaluation.posed.retrieval import nearest_image_scores, read_library
from active_recon.evaluation.posed.robustness import (
    cut_views,
    disturbances,
    poses_off,
    turned_back,
    YAWS,
)
from active_recon.evaluation.posed.scene import chosen_folders, read_scene, Scene
from active_recon.evaluation.posed.scoring import pooled, scored, target
from active_recon.evaluation.posed.study import Extent, read_set, study_set
from active_recon.evaluation.posed.summary import figure, markdown, robustness_figures
from active_recon.evaluation.posed.walking import some_objects
from active_recon.models.carving import Carving
from active_recon.models.lifted import projected, projection
from active_recon.models.weights_files import find_weights
from active_recon.training.gain_files import collect_gains, Collecting
from active_recon.training.view_gains import ViewGains
from active_recon.volumes.voxels import iou, turned
from coarse_hull import Coarse
import numpy as np
import pytest
from scipy.special import logit
import torch

PLAN = Plan((1, 2, 4), (2,), bfloat16=False)
EXTENT = Extent(most=2, disturbed_views=2, disturbed_objects=1)


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Return a folder of three chairs seen by any five cameras each."""
    out = tmp_path_factory.mktemp('posed')
    list(make_dataset(shape_jobs('chair', range(3), out), 1, fine=True,
                      viewing=Viewing('any', 5)))
    return out


@pytest.fixture(scope='module')
def scene(made):
    return read_scene(list_objects(made), [Carving(0)])


@pytest.fixture
def carving():
    return Entrant('carving', Carving(0).eval(), {64: 0.5, 32: 0.5})


@pytest.fixture
def coarse():
    return Entrant('coarse', Coarse(0).eval(), {32: 0.5})


@pytest.fixture
def paper(network):
    return Entrant('paper', network, {64: 0.3, 32: 0.3})


@cache
def a_target():
    rng = np.random.default_rng(0)
    fine = np.zeros((64, 64, 64), bool)
    fine[10:40, 12:50, 20:45] = True
    fine[20, 20, 45:60] = True
    fine[rng.integers(64, size=20), rng.integers(64, size=20), rng.integers(64, size=20)] = True
    return target({64: fine, 32: pooled(fine, 32)})


def sure_logits(cells):
    return np.where(cells, np.float32(12), np.float32(-12))


def test_the_truth_itself_has_the_best_scores(carving):
    truth = a_target()
    scores, diagrams = scored(sure_logits(truth.cells[64]), truth, carving, 1, surfaces=True)
    for name in ('iou_64', 'iou_32', 'own_iou_64', 'own_iou_32', 'thin_recall'):
        assert scores[name] == 1, name
    assert scores['expected_iou'] == pytest.approx(1, abs=1e-3)
    assert scores['brier'] < 1e-8
    assert scores['f_score_1'] > 0.98 and scores['chamfer'] < 0.01
    assert diagrams['calibration_error'][0].sum() == truth.near.sum()


def test_precision_and_recall_make_the_iou(carving):
    truth = a_target()
    logits = np.random.default_rng(0).normal(0, 2, (64,) * 3).astype(np.float32)
    scores, _ = scored(logits + 4 * truth.cells[64], truth, carving, 1, surfaces=False)
    assert 0 < scores['precision'] < scores['recall'] < 1
    assert 1 / scores['iou_64'] == pytest.approx(
        1 / scores['precision'] + 1 / scores['recall'] - 1, rel=1e-5)


def test_temperatures_are_those_of_the_number_of_views(carving):
    truth = a_target()
    logits = np.random.default_rng(0).normal(0, 2, (64,) * 3).astype(np.float32)
    doubtful = replace(carving, temperatures={3: 4.0}, grid_temperatures={3: 4.0})
    plain, cooled = (scored(logits, truth, doubtful, count, False)[0] for count in (1, 3))
    assert plain['tempered_brier'] == plain['brier'] == cooled['brier'] > cooled['tempered_brier']
    by_hand, _ = scored(logits / 4, truth, carving, 3, False)
    assert cooled['tempered_own_iou_64'] == pytest.approx(by_hand['own_iou_64'])
    assert cooled['iou_64'] == plain['iou_64']


def test_what_is_not_there_is_said_to_be_the_worst(carving):
    scores, _ = scored(np.full((64,) * 3, -9, np.float32), a_target(), carving, 1, surfaces=True)
    for name in ('iou_64', 'f_score_2', 'thin_recall', 'recall'):
        assert scores[name] == 0, name
    assert math.isnan(scores['precision'])
    assert scores['chamfer'] == pytest.approx(math.sqrt(3))


def test_what_no_camera_can_tell_costs_nothing_of_the_iou_of_filled_truths(carving):
    solid = np.zeros((64, 64, 64), bool)
    solid[10:50, 10:50, 10:50] = True
    hollow = solid.copy()
    hollow[14:46, 14:46, :46] = False  # open below
    truth = target({64: hollow}, surface=False)
    scores, _ = scored(sure_logits(solid), truth, carving, 1, surfaces=False)
    assert scores['iou_64'] == pytest.approx(hollow.sum() / solid.sum())
    assert scores['filled_iou_64'] > 0.9
    own, _ = scored(sure_logits(hollow), truth, carving, 1, surfaces=False)
    assert own['iou_64'] == 1 and own['filled_iou_64'] == pytest.approx(
        hollow.sum() / truth.filled[64].sum())


def test_coarse_cells_are_full_where_any_of_theirs_is():
    cells = np.random.default_rng(0).random((8, 8, 8)) < 0.1
    blocks = cells.reshape(4, 2, 4, 2, 4, 2).transpose(0, 2, 4, 1, 3, 5).reshape(4, 4, 4, 8)
    np.testing.assert_array_equal(pooled(cells, 4), blocks.any(axis=3))
    np.testing.assert_array_equal(pooled(cells, 8), cells)


def test_a_scene_has_the_truth_of_both_sizes(scene):
    assert scene.truths[64].shape == (3, 64, 64, 64) and scene.truths[32].shape == (3, 32, 32, 32)
    assert scene.view_count == 5 and not scene.turntable


def test_an_object_whose_coarse_voxels_cannot_be_read_is_left_out_of_a_scene(
        made, scene, tmp_path):
    first, *others = list_objects(copytree(made, tmp_path / 'chairs'))
    first.voxels_path(32).write_bytes(b'#binvox 1')
    some = read_scene([first, *others], [Carving(0)])
    assert some.views.folders == tuple(others)
    assert [str(first.voxels_path(32)) in reason for reason in some.views.unreadable] == [True]
    for side, truth in some.truths.items():
        assert (truth == scene.truths[side][1:]).all()
    assert (some.views.images == scene.views.images[1:]).all()
    with pytest.raises(DataError, match='no readable object: .*\n.*no whole binvox file'):
        read_scene([first], [Carving(0)])


def test_random_views_measure_what_a_loop_by_hand_does(scene, carving):
    found = measure(scene, [carving], PLAN)['carving'].values['random']
    order = orders_of(scene, PLAN)['random'][-1]
    for row in range(3):
        state = carving.network.initial_state(1)
        for view in order[row, :2].tolist():
            one = torch.tensor([row]), torch.tensor([view])
            state = carving.network.step(scene.views.white(*one), scene.views.cameras(*one), state)
        occupied = carving.network.decode(state)[0] > 0
        assert found['iou_64'][row, 1] == pytest.approx(
            float(iou(occupied, scene.truths[64][row])))
        coarse = torch.from_numpy(pooled(occupied.numpy(), 32))
        assert found['iou_32'][row, 1] == pytest.approx(float(iou(coarse, scene.truths[32][row])))
    assert found['iou_64'].shape == (3, 3)
    assert np.isnan(found['f_score_1'][:, [0, 2]]).all()
    assert (found['f_score_1'][:, 1] > 0).all()


def test_a_network_that_needs_the_front_joins_in_on_a_turntable_alone(dataset, scene, coarse,
                                                                       paper):
    with pytest.raises(ConfigError, match='paper: cannot use these views: expected 24 azimuths'):
        next(logits_of(scene, paper, torch.arange(1), orders_of(scene, PLAN)['random']))
    turntable = read_scene(list_objects(dataset)[:2], [coarse.network, paper.network])
    plan = Plan((1, 3), ())
    found = measure(turntable, [coarse, paper], plan)
    for measured in found.values():
        # There are no finer voxels
        assert set(measured.values['even']) == {'iou_32', 'filled_iou_32'}
        assert np.isfinite(measured.values['random']['iou_32']).all()


class Small(Carving):
    """The same hull of images of half the size."""

    image_size = 64

    def update(self, encoded, cameras, state):
        doubled = cameras.intrinsics * torch.tensor([2, 2, 1.0])[:, None]
        return super().update(encoded, cameras._replace(intrinsics=doubled), state)


@pytest.fixture
def small():
    return Entrant('small', Small(0).eval(), {64: 0.5, 32: 0.5})


def test_a_network_of_smaller_images_is_measured_on_the_same_views(made, carving, small):
    scene = read_scene(list_objects(made)[:2], [carving.network, small.network])
    assert scene.shown_to(small.network).image_size == 64
    torch.testing.assert_close(scene.shown_to(small.network).poses, scene.views.poses)
    measured = measure(scene, [carving, small], replace(PLAN, surfaces=()))
    large, own = (measured[name].values['random']['iou_32'] for name in ('carving', 'small'))
    np.testing.assert_allclose(own, large, atol=0.1)
    assert np.abs(own - large).max() > 0  # it is not shown the same images


def test_gains_are_measured_of_a_network_of_smaller_images(made, small, tmp_path):
    folder = list_objects(made)[0]
    (path,), _ = collect_gains([folder], small, Collecting(1, 3, 1, 2), tmp_path)
    assert np.isfinite(ViewGains.load(path).gains).any()


def test_a_damaged_note_of_how_gains_were_collected_is_told(made, small, tmp_path):
    (tmp_path / 'collected.json').write_text('{"obj')
    with pytest.raises(DataError, match='collected.json: no readable note of how gains were'):
        collect_gains(list_objects(made)[:1], small, Collecting(1, 3, 1, 2), tmp_path)


def test_thresholds_are_chosen_where_iou_is_best(scene):
    class Timid(Carving):
        def decode(self, state):
            return super().decode(state) * 0.1 + float(logit(0.2))

    entrant = Entrant('timid', Timid(0).eval(), {64: 0.5, 32: 0.5})
    chosen = choose(scene, [entrant], PLAN, 'validation')[0]
    # A cell is full where the foreground's share is a half: there it says 0.2
    assert chosen.thresholds[64] == pytest.approx(0.2, abs=0.051)
    assert set(chosen.temperatures) == set(chosen.grid_temperatures) == {1, 2, 4}
    assert chosen.chosen_on == 'validation'


def test_what_cannot_be_shown_the_validation_objects_stays(scene, paper):
    assert choose(scene, [paper], PLAN, 'validation') == [paper]


def test_poses_are_off_by_the_angle(scene):
    off = poses_off(scene.views, math.radians(2))
    turns = off[..., :3, :3] @ scene.views.poses[..., :3, :3].mT
    angles = torch.arccos((turns.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2).rad2deg()
    torch.testing.assert_close(angles, torch.full_like(angles, 2))
    torch.testing.assert_close(off[..., :3, 3].norm(dim=-1),
                               scene.views.poses[..., :3, 3].norm(dim=-1))


def test_a_cut_view_lacks_a_third_of_the_cube(scene):
    chosen = np.array([0, 3, 1])
    cut = cut_views(scene.views, chosen, 1 / 3)
    for row, view in enumerate(chosen.tolist()):
        others = [other for other in range(5) if other != view]
        torch.testing.assert_close(cut.seen[row, others], scene.views.seen[row, others])
        one = scene.views.cameras(torch.tensor([row]), torch.tensor([view]))
        where, _ = projected(projection(one, 128), 32)
        pixel = ((where[0] + 1) * 64).floor().long().clamp(0, 127)
        before, after = (seen[row, view][pixel[:, 1], pixel[:, 0]].float().mean()
                         for seen in (scene.views.seen, cut.seen))
        assert float(after) <= 0.69 and float(before - after) < 0.36
        assert not cut.images[row, view][~cut.seen[row, view]].any()


@pytest.mark.parametrize('yaw_deg', [90, 180, 270, 15, 200])
def test_what_was_turned_is_turned_back(yaw_deg):
    at = (np.arange(32) + 0.5) / 32 - 0.5
    x, y, z = np.meshgrid(at, at, at, indexing='ij')
    shape = np.exp(-20 * ((x - 0.15) ** 2 + (y + 0.1) ** 2 * 3 + z ** 2)).astype(np.float32)
    yaw = math.radians(yaw_deg)
    back = turned_back(turned(shape, yaw), yaw)
    known = ~np.isnan(back)
    assert known.all() == (yaw_deg % 90 == 0) and known.mean() > 0.8
    np.testing.assert_allclose(back[known], shape[known], atol=0.05)  # peaks, twice interpolated


def test_disturbances_are_those_of_objects_of_every_category(dataset, coarse):
    scene = read_scene(list_objects(dataset), [Carving(0)])
    rows = {found.row for found in disturbances(scene, coarse, PLAN, 1, 2)}
    assert sorted(scene.views.categories[sorted(rows)]) == ['lamp', 'table']


@pytest.mark.slow
def test_every_object_is_disturbed_in_its_own_way(scene, coarse, monkeypatch):
    monkeypatch.setattr(robustness, 'YAWS', 1)
    rows = torch.zeros(12, dtype=torch.long)
    alike = Scene({128: some_objects(scene.views, rows)},
                  {32: scene.truths[32][rows]}, {})
    found = list(disturbances(alike, coarse, PLAN, scene.view_count, len(rows)))
    for name in ('poses off by 2 degrees', 'a third of the cube cut'):
        ious = [each.disturbed['iou_32'] for each in found if each.name == name]
        assert len({*map(tuple, np.reshape(ious, (3, 4)))}) == 3


@pytest.mark.slow
def test_yaws_of_carving_hardly_differ(scene, carving):
    found = list(disturbances(scene, carving, PLAN, 3, 2))
    figures = robustness_figures(found)
    for name in ('iou_64', 'iou_32'):
        yaw = figures['yaw'][name]
        assert len(yaw['by_yaw']) == YAWS
        assert yaw['quarters'] < 1e-3 and yaw['spread'] < 0.03
    rows = figures['disturbances']
    assert {'poses off by 2 degrees', 'a third of the cube cut'} < set(rows)
    assert any(name.startswith('elevation') for name in rows)
    for row in rows.values():
        change = row['iou_64']['figure']['mean'] - row['iou_64']['clean']['mean']
        assert row['iou_64']['change']['mean'] == pytest.approx(change)


def test_the_nearest_image_of_a_known_object_is_its_own(made, scene):
    library = read_library(list_objects(made))
    for view in range(2):
        for scores in nearest_image_scores(library, scene, np.full(3, view)):
            assert scores == {'iou_64': 1, 'iou_32': 1}


def test_intervals_leave_out_what_was_not_measured():
    values = np.array([0.2, np.nan, 0.4])
    assert figure(values)['objects'] == 2 and figure(values)['mean'] == pytest.approx(0.3)
    assert figure(values, np.array([0.1, 0.1, np.nan]))['objects'] == 1
    assert figure(np.full(3, np.nan)) is None


def test_a_study_says_all_of_a_folder_and_can_be_written(made, carving, paper):
    other = replace(carving, name='dilated', network=Carving(2).eval())
    library = read_library(list_objects(made))
    figures = study_set(made, [carving, other, paper], PLAN, EXTENT, library)
    assert list(figures['models']) == ['carving', 'dilated'] and 'paper' in figures['left_out']
    ahead = figures['ahead']['dilated']['random']['iou_64']
    means = [[each['mean'] for each in figures['models'][name]['random']['iou_64']]
             for name in ('carving', 'dilated')]
    np.testing.assert_allclose([each['mean'] for each in ahead], np.subtract(*means))
    own, fixed, gain = ([each['mean'] for each in figures['models']['carving'][part][name]]
                        for part, name in (('random', 'own_iou_64'), ('random', 'iou_64'),
                                           ('own_ahead', 'own_iou_64')))
    np.testing.assert_allclose(gain, np.subtract(own, fixed))
    json.dumps(figures, allow_nan=False)
    text = markdown({'command': 'active-recon study', 'sets': [figures]})
    for words in ('paper is left out', '### IoU at 32 cells, even views', 'ahead of dilated',
                  'nearest training image', 'F-score at 2 %', '24 yaws', 'Recall of thin parts',
                  'carving, ahead of a fixed one'):
        assert words in text


def test_the_text_of_a_study_tells_what_is_of_some_objects_alone():
    values = {'thin_recall': [0.2, np.nan, 0.4], 'recall': [0.2, 0.3, 0.4]}
    figures = {'data': 'a folder', 'objects': 3, 'views': 5, 'cells': [64], 'counts': [1],
               'left_out': {}, 'ahead': {}, 'models': {'one': {
                   'random': {name: [figure(np.array(own))] for name, own in values.items()},
                   'own_ahead': {}, 'calibration': {}}}}
    rows = [line for line in markdown({'command': 'study', 'sets': [figures]}).splitlines()
            if line.startswith('| one |')]
    assert [row.endswith('] of 2 |') for row in rows] == [True, False]


def test_a_study_that_nothing_can_be_shown_is_refused(made, paper):
    with pytest.raises(ConfigError, match='no model for these views: expected one'):
        study_set(made, [paper], PLAN, EXTENT)


def test_objects_are_chosen_by_their_category(dataset):
    folders = list_objects(dataset)
    assert {each.category for each in chosen_folders(folders, 'la*')} == {'lamp'}
    assert {each.category for each in chosen_folders(folders, '!la*')} == {'table'}
    assert len(chosen_folders(folders, most=4)) == 4
    with pytest.raises(ConfigError, match=r"got 'car'; there are lamp, table"):
        chosen_folders(folders, 'car')


def test_a_dataset_without_objects_is_refused_as_that_with_its_name(tmp_path):
    (tmp_path / 'ShapeNetRendering').mkdir()
    with pytest.raises(DataError, match=f'{tmp_path}: a dataset without objects: expected one'):
        read_set(tmp_path, [], EXTENT)


def test_counts_rise():
    assert Plan().within(12) == (1, 2, 3, 5, 8, 12)
    with pytest.raises(ConfigError, match='too many views: expected at most the 4 of the objects, '
                       'got 5,8'):
        Plan((5, 8)).within(4)
    for wrong in ((), (0, 1), (3, 2), (1, 1)):
        with pytest.raises(ConfigError, match='counts: invalid numbers of views: expected incr'):
            Plan(wrong)


def test_entrants_are_named_apart():
    first, second = load_entrants('carving, other=carving')
    assert (first.name, second.name) == ('carving', 'other')
    assert first.thresholds == {64: 0.5, 32: 0.5} and first.sides == (64, 32)
    with pytest.raises(ConfigError, match="got 'carving' twice"):
        load_entrants('carving,carving')
    with pytest.raises(ConfigError, match='models: empty list: .* got none'):
        load_entrants(' , ')
    with pytest.raises(WeightsError, match='no such file'):
        load_entrants('carving,x=none.safetensors')


def test_the_path_of_an_entrant_may_have_an_equals_sign_in_it(tmp_path, monkeypatch):
    file = tmp_path / 'lr=1e-3' / 'mine.safetensors'
    file.parent.mkdir()
    file.write_bytes(find_weights('carving').read_bytes())
    plain, named = load_entrants(f'{file},new={file}')
    assert (plain.name, named.name) == ('mine', 'new')
    assert plain.path == named.path == file
    monkeypatch.chdir(tmp_path)
    [near] = load_entrants('lr=1e-3/mine.safetensors')
    assert near.name == 'mine'
    with pytest.raises(WeightsError, match=r'a/lr=1/none.safetensors: no such file'):
        load_entrants('a/lr=1/none.safetensors')
