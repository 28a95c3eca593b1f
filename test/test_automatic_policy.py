"""The policy `auto`: the learned one of the weights at hand, else an even sweep."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

from active_recon.errors import WeightsError
from active_recon.models.weights_files import find_weights, PAPER_MODEL, SHIPPED
from active_recon.policies import (
    AUTO_POLICY,
    load_policy,
    policy_in_use,
    PolicyInUse,
    PolicyOptions,
)
import pytest

ROOT = Path(__file__).parents[1]
SCORER = SHIPPED.with_name(f'{SHIPPED.stem}-scorer.safetensors')


@pytest.fixture
def weights(tmp_path):
    """Return weights that have no learned policy, in a folder of their own."""
    return Path(shutil.copy(find_weights('2d3d'), tmp_path / 'mine.safetensors'))


@pytest.mark.parametrize('model', [None, PAPER_MODEL])
def test_it_is_the_learned_policy_where_the_weights_have_one(model):
    path = find_weights(model)
    assert policy_in_use(AUTO_POLICY, path) == PolicyInUse('attention')
    loaded, learned = (load_policy(name, PolicyOptions(weights=path))
                       for name in (AUTO_POLICY, 'attention'))
    assert type(loaded) is type(learned)


def test_it_is_an_even_sweep_where_they_have_none(weights):
    assert policy_in_use(AUTO_POLICY, weights) == PolicyInUse('uniform')
    assert isinstance(load_policy(AUTO_POLICY, PolicyOptions(weights=weights)),
                      type(load_policy('uniform')))


def a_scorer_of_others(path):
    shutil.copy(SCORER, path)


def half_a_scorer(path):
    path.write_bytes(SCORER.read_bytes()[:10_000])


@pytest.mark.parametrize(('make', 'said'), [
    (a_scorer_of_others, 'view policy of other weights: expected one trained for '),
    (half_a_scorer, 'no whole safetensors file')])
def test_a_learned_policy_that_cannot_be_used_is_an_even_sweep_that_says_so(weights, make, said):
    make(weights.with_name('mine-scorer.safetensors'))
    found = policy_in_use(AUTO_POLICY, weights)
    assert found.name == 'uniform'
    assert said in found.warning
    assert 'active-recon train-policy' in found.warning
    assert '\n' not in found.warning


@pytest.mark.parametrize('name', ['farthest', 'attention', 'uniform'])
def test_every_other_name_means_itself_whatever_the_weights(name, tmp_path):
    assert policy_in_use(name, tmp_path / 'none.safetensors') == PolicyInUse(name)


def test_weights_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(WeightsError, match='no such file'):
        policy_in_use(AUTO_POLICY, tmp_path / 'none.safetensors')


def test_which_policy_it_is_is_known_without_torch():
    code = ('import sys; from active_recon.policies import policy_in_use; '
            'print(policy_in_use("auto").name, "torch" in sys.modules)')
    ended = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                           env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert ended.stdout == 'attention False\n', ended.stderr
