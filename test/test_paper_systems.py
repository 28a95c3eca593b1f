"""The compared systems: the same objects, as many views, trained once."""

from contextlib import contextmanager
from dataclasses import replace
import json

from active_recon.errors import ConfigError, WeightsError
from active_recon.models import weights_files as weights_module
from active_recon.models.network_2d3d import SIZES
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import FOLDER, read_card
from active_recon.paper import comparison, systems
from active_recon.paper.comparison import Compared, cost_table
from active_recon.paper.study import Study
from active_recon.paper.systems import (
    find_system,
    have_systems,
    JOINT,
    R2N2,
    System,
    SYSTEMS,
    training_plan,
    TWO_STAGE,
)
from active_recon.paper.trainings import views_seen
from paper_study import untrained
import pytest


@pytest.fixture
def study(dataset, tmp_path):
    """Return a study whose sets are all the same six objects, and that has no weights yet."""
    data = tmp_path / 'data'
    data.mkdir()
    for name in ('train', 'val', 'test'):
        (data / name).symlink_to(dataset)
    return Study(data, tmp_path / 'models', tmp_path / 'results', samples=9)


@pytest.fixture
def small_batches(monkeypatch, tiny):
    """Let systems learn from few views, and be of networks that are fast."""
    monkeypatch.setitem(SIZES, 'small', tiny)
    monkeypatch.setattr(systems, 'BATCH', 2)
    monkeypatch.setattr(systems, 'POLICY_BATCH', 2)


@pytest.mark.parametrize('system', SYSTEMS, ids=lambda system: system.name)
@pytest.mark.parametrize('samples', [30_000, 150_000])
def test_every_system_sees_as_many_views(system, samples):
    if system.model not in systems.NETWORKS:
        pytest.fail(f'{system.model} is not in the registry')
    plan = training_plan(system, samples)
    card = {'scheme': 'joint' if plan.joint else 'two-stage',
            'reconstruction': plan.reconstruction.to_dict()}
    assert views_seen(card) == pytest.approx(samples, rel=0.01)


def test_what_is_fitted_in_one_go_sees_no_views():
    assert views_seen({'model': 'shape-basis', 'reconstruction': {
        'steps': 1, 'batch_size': 2, 'max_views': 5}}) is None
    assert views_seen({}) is None


def test_only_what_is_fitted_in_one_go_is_told_to_be(study, tiny, tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, '_million_operations', lambda study, row: None)
    unknown = untrained(tmp_path / 'unknown', tiny, 0)
    card = read_card(unknown)
    unknown.with_suffix('.json').write_text(json.dumps({**card, 'begun_with': {}}))
    table = cost_table(study, [Compared('fitted', FOLDER / 'carving.safetensors'),
                               Compared('trained', untrained(tmp_path / 'known', tiny, 0)),
                               Compared('unknown', unknown)])
    seen = next(column for column in table.columns if column.heading == 'views seen in training')
    assert seen.cells[0] == 'fitted' and seen.cells[1] > 0 and seen.cells[2] is None


def test_views_of_the_weights_that_a_training_began_with_count_too():
    assert views_seen(read_card(FOLDER / '2d3d.safetensors')) == 720_000
    assert views_seen(read_card(FOLDER / '2d3d-attention.safetensors')) == 720_000 + 960_000
    further = {'reconstruction': {'steps': 10, 'batch_size': 2, 'max_views': 1}}
    assert views_seen(further) == 20
    assert views_seen(further | {'begun_with': further}) == 40
    assert views_seen(further | {'begun_with': {}}) is None


def test_a_missing_system_is_trained_and_then_found(study, small_batches):
    [path] = have_systems(study, [TWO_STAGE]).values()
    assert path == study.models / 'two-stage' / 'weights.safetensors'
    bundle, card = load_weights(path), json.loads(path.with_suffix('.json').read_text())
    assert bundle.attention is not None
    assert card['views_seen'] == 9
    assert card['objects'][0]['objects'] == 6
    assert card['command'].startswith('active-recon paper systems ')
    before = path.read_bytes()
    assert have_systems(study, [TWO_STAGE]) == {TWO_STAGE: path}
    assert path.read_bytes() == before
    for other, told in (({'seed': 3}, 'seed: expected 0 as before, got 3'),
                        ({'samples': 36}, 'views_seen: expected 9 as before, got 36'),
                        ({'training': ('train', 'val')}, 'objects: expected')):
        with pytest.raises(ConfigError, match=f'another training: {told}'):
            have_systems(replace(study, **other), [TWO_STAGE])


@pytest.mark.slow
def test_a_training_is_told_as_it_goes(study, small_batches):
    told = []

    @contextmanager
    def progress(title, total):
        done = []
        yield lambda steps, note: done.append(steps)
        told.append((title, total, sum(done)))

    have_systems(replace(study, progress=progress), [System('plain', 'plain', '2d3d')])
    assert ('plain: reconstruction', 2, 2) in told


def test_weights_that_ship_are_taken_only_if_they_saw_as_many_views(
        study, tiny, tmp_path, monkeypatch):
    shipped = untrained(tmp_path / 'shipped', tiny, 0)
    monkeypatch.setattr(weights_module, 'FOLDER', shipped.parent)
    shipped.rename(shipped.with_name('r2n2.safetensors'))
    shipped.with_suffix('.json').rename(shipped.with_name('r2n2.json'))
    assert find_system(study, R2N2) is None  # 72 views, not 9
    same = Study(study.data, study.models, study.out, samples=72)
    assert find_system(same, R2N2) == shipped.with_name('r2n2.safetensors')
    own = untrained(study.models / 'r2n2', tiny, 1)
    assert find_system(same, R2N2) == own
    assert find_system(same, JOINT) is None


def test_a_system_of_64_cells_needs_a_truth_as_fine(study):
    names = [system.name for system in systems.systems(study)]
    assert 'ogn' in names
    assert 'ogn-64' not in names


def test_a_study_without_its_weights_says_how_to_get_some(tmp_path):
    with pytest.raises(WeightsError, match='--model'):
        _ = Study(model=str(tmp_path / 'none.safetensors')).weights


@pytest.mark.slow
def test_what_is_fitted_in_one_go_is_fitted_where_others_are_trained(
        study, monkeypatch, tmp_path):
    monkeypatch.setattr(weights_module, 'FOLDER', tmp_path)  # in which nothing ships
    [path] = have_systems(study, [systems.SHAPE_BASIS]).values()
    assert path.is_relative_to(study.models)
    assert float(load_weights(path).reconstruction.state_dict()['means'].std()) > 0


@pytest.mark.parametrize('system', SYSTEMS, ids=lambda system: system.name)
def test_what_ships_is_taken_under_the_usual_settings(system, tmp_path):
    assert find_system(Study(models=tmp_path), system) == FOLDER / f'{system.name}.safetensors'
    assert (FOLDER / f'{system.name}.safetensors').stat().st_size < 10e6
