"""Networks and policies of one's own: from a file, and from an installed package."""

from pathlib import Path

from active_recon.errors import ConfigError, WeightsError
from active_recon.models import registry
from active_recon.models.registry import named_network, network_entry, OWN_NETWORKS
from active_recon.models.weights import load_weights
from active_recon.plugins import installed, load_from_file, NETWORKS_GROUP, POLICIES_GROUP
from active_recon.policies.registry import _installed, PolicyOptions
from command_line import command
import pytest

EXAMPLE = Path(__file__).parents[1] / 'examples' / 'my_network.py'


@pytest.fixture(autouse=True)
def none_known(monkeypatch):
    monkeypatch.setattr(registry, '_OWN', {})


def test_the_example_is_trained_for_ten_steps_and_its_weights_load_where_it_is_named(
        dataset, tmp_path, monkeypatch, capsys):
    import torch

    threads = torch.get_num_threads()
    assert command(monkeypatch, 'train', dataset, '--validation', dataset, '--out', tmp_path,
                   '--model', f'{EXAMPLE}:Net', '--steps', 10, '--batch-size', 2, '--threads',
                   1) == 0
    torch.set_num_threads(threads)
    told = capsys.readouterr().out
    assert f'they load where {OWN_NETWORKS}={EXAMPLE}:Net is set' in ' '.join(told.split())
    weights = tmp_path / 'weights.safetensors'
    assert load_weights(weights).model == 'Net'
    registry._OWN.clear()  # as in another process
    with pytest.raises(WeightsError, match=f"no network is called 'Net'.*{OWN_NETWORKS}"):
        load_weights(weights)
    monkeypatch.setenv(OWN_NETWORKS, f'{EXAMPLE}:Net')
    assert type(load_weights(weights).reconstruction).__name__ == 'Net'


def test_a_file_that_has_no_network_is_refused(tmp_path):
    path = tmp_path / 'mine.py'
    path.write_text('Net = 3\n')
    with pytest.raises(ConfigError, match='neither a NetworkEntry nor'):
        named_network(f'{path}:Net')
    with pytest.raises(ConfigError, match='has no Other'):
        named_network(f'{path}:Other')
    with pytest.raises(ConfigError, match='no such file'):
        load_from_file(f'{tmp_path}/none.py:Net')
    path.write_text('1 / 0\n')
    with pytest.raises(ConfigError, match='fails with ZeroDivisionError'):
        load_from_file(f'{path}:Net')


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Install a package that offers a network and a policy."""
    (tmp_path / 'mine.py').write_text(
        EXAMPLE.read_text() + '\nfrom active_recon.policies.geometric import FarthestPolicy\n')
    metadata = tmp_path / 'mine-1.0.dist-info'
    metadata.mkdir()
    (metadata / 'METADATA').write_text('Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n')
    (metadata / 'entry_points.txt').write_text(
        f'[{NETWORKS_GROUP}]\nmine = mine:Net\nbroken = mine:Nothing\n'
        f'[{POLICIES_GROUP}]\nfar = mine:FarthestPolicy\n')
    monkeypatch.syspath_prepend(tmp_path)
    installed.cache_clear()
    yield
    installed.cache_clear()


def test_what_an_installed_package_offers_is_known_by_its_name(package):
    entry = network_entry('mine')
    assert type(entry.build(entry.sizes['small'])).__name__ == 'Net'
    assert _installed('far')(PolicyOptions()).initial_state(1) == {}
    with pytest.raises(ConfigError, match='broken: cannot be imported'):
        network_entry('broken')
