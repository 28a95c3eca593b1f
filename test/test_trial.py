"""Episodes that are kept, and made anew where anything they depend on has changed."""

from dataclasses import replace
import json

from active_recon.errors import DataError
from active_recon.evaluation import trial as trial_module
from active_recon.evaluation.contenders import contenders
from active_recon.evaluation.trial import Contender, data_hash, Trial
from active_recon.models.weights import state_hash
import numpy as np
import pytest
from shown_views import part_of
import torch


@pytest.fixture
def blocks_of_five(monkeypatch):
    monkeypatch.setattr(trial_module, '_BLOCK', 5)


def refused(rng):
    raise AssertionError('expected nothing to be run anew')


def kept(contender):
    """Return the contender with a policy that must not be asked."""
    return replace(contender, make=refused)


def same(first, second):
    return all(np.array_equal(getattr(first, name), getattr(second, name))
               for name in ('iou', 'entropy', 'paper_entropy', 'azimuths'))


def test_what_was_run_once_is_read_the_next_time(network, views, tmp_path, blocks_of_five):
    (random,) = contenders(['random'], seeds=1)
    told = []
    first = Trial(network, 0.1, views, 2, 3, cache=tmp_path).run(random)
    again = Trial(network, 0.1, views, 2, 3, cache=tmp_path).run(kept(random), told.append)
    assert first.iou.shape == (12, 3)
    assert same(first, again)
    assert sum(told) == 12


def test_a_run_that_was_cut_off_goes_on_to_the_same_end(
        network, views, tmp_path, blocks_of_five):
    (random,) = contenders(['random'], seeds=1)
    trial = Trial(network, 0.1, views, 2, 3, cache=tmp_path)
    whole = trial.run(random)
    (last,) = trial.folder.glob('random-0-002.npz')
    last.unlink()
    assert same(trial.run(random), whole)
    assert same(Trial(network, 0.1, views, 2, 3).run(random), whole)


def test_seeds_of_random_differ_and_repeat(network, views):
    trial = Trial(network, 0.1, views, 2, 3)
    zero, one = contenders(['random'], seeds=2)
    assert same(trial.run(zero), trial.run(zero))
    assert not same(trial.run(zero), trial.run(one))


def test_whatever_episodes_depend_on_has_a_folder_of_its_own(network, tiny, views, tmp_path):
    from active_recon.models.network_2d3d import Network2d3d
    torch.manual_seed(1)
    other = Network2d3d.from_config(tiny).eval()
    fewer = part_of(views, slice(5))
    moved = replace(views, poses=views.poses.flip(1))
    zoomed = replace(views, intrinsics=views.intrinsics * 1.1)
    turned = replace(views, voxels=views.voxels.flip(1))
    plain = {'starts': 2, 'count': 3, 'cache': tmp_path}
    trials = [Trial(network, 0.1, views, **plain), Trial(other, 0.1, views, **plain),
              Trial(network, 0.2, views, **plain), Trial(network, 0.1, fewer, **plain),
              Trial(network, 0.1, turned, **plain), Trial(network, 0.1, moved, **plain),
              Trial(network, 0.1, zoomed, **plain)]
    trials += [Trial(network, 0.1, views, **plain | change) for change in (
        {'starts': 3}, {'count': 2}, {'seed': 1}, {'bfloat16': True})]
    assert len({trial.folder for trial in trials}) == len(trials)
    for trial in trials:
        assert json.loads((trial.folder / 'identity.json').read_text()) == trial.identity


def test_without_a_cache_nothing_is_written(network, views, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Trial(network, 0.1, views, 1, 2).run(contenders(['farthest'])[0])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('content', [b'', b'PK broken', None])
def test_what_was_kept_and_broke_is_refused_by_its_name(network, views, tmp_path, content):
    trial = Trial(network, 0.1, views, 1, 2, cache=tmp_path)
    path = trial.folder / 'uniform-000.npz'
    if content is None:
        np.savez(path, iou=np.zeros(3))
    else:
        path.write_bytes(content)
    with pytest.raises(DataError, match='uniform-000.npz.*delete it'):
        trial.run(Contender('uniform', 'uniform', refused))


def test_half_precision_changes_little(network, views):
    (farthest,) = contenders(['farthest'])
    full = Trial(network, 0.1, views, 2, 3).run(farthest)
    half = Trial(network, 0.1, views, 2, 3, bfloat16=True).run(farthest)
    np.testing.assert_allclose(half.entropy, full.entropy, rtol=0.02)
    assert not same(half, full)


def test_hashes_tell_states_and_sets_apart(network, views):
    assert state_hash(network) == state_hash(network)
    before = state_hash(network)
    with torch.no_grad():
        next(network.parameters()).add_(1)
    assert state_hash(network) != before
    assert data_hash(views) == data_hash(replace(views))
    assert data_hash(replace(views, poses=views.poses + 1)) != data_hash(views)
    seen = torch.ones(views.images.shape[:-1], dtype=torch.bool)
    hashes = {data_hash(replace(views, seen=each)) for each in (None, seen, ~seen)}
    assert len(hashes) == 3
