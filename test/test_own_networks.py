"""Networks and policies of one's own: from a file, and from an installed package."""

from pathlib import Path
import re
import sys

from active_recon.cluster.local import LocalCrew
from active_recon.errors import ConfigError, WeightsError
from active_recon.evaluation.contenders import contenders, heuristic_names
from active_recon.evaluation.posed.entrants import load_entrants
from active_recon.evaluation.trial import Trial
from active_recon.exporting.export import export
from active_recon.geometry.cameras import orbit_camera
from active_recon.models import registry
from active_recon.models.network import Cameras
from active_recon.models.registry import (
    named_network,
    network_entry,
    NETWORKS,
    OWN_NETWORKS,
)
from active_recon.models.trial import try_network
from active_recon.models.weights import Bundle, load_weights, save_weights, state_hash
from active_recon.plugins import installed, load_from_file, NETWORKS_GROUP, POLICIES_GROUP
from active_recon.policies import POLICIES
from active_recon.policies.geometric import FarthestPolicy
from active_recon.policies.registry import _installed, PolicyEntry, PolicyOptions
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import load_runtime
from command_line import command, refusal
import numpy as np
import pytest
import torch

EXAMPLE = Path(__file__).parents[1] / 'examples' / 'my_network.py'


@pytest.fixture(autouse=True)
def none_known(monkeypatch):
    monkeypatch.setattr(registry, '_OWN', {})


def test_the_example_is_trained_for_ten_steps_and_its_weights_load_where_it_is_named(
        dataset, tmp_path, monkeypatch, capsys):
    threads = torch.get_num_threads()
    network = tmp_path / 'my network.py'
    network.write_text(EXAMPLE.read_text())
    assert command(monkeypatch, 'train', dataset, '--validation', dataset, '--out', tmp_path,
                   '--model', f'{network}:Net', '--steps', 10, '--batch-size', 2, '--threads',
                   1) == 0
    torch.set_num_threads(threads)
    told = capsys.readouterr().out
    told_name = f"they load where {OWN_NETWORKS}='{network}:Net' is set"  # for a shell to read
    assert told_name in ' '.join(told.split())
    weights = tmp_path / 'weights.safetensors'
    assert load_weights(weights).model == 'Net'
    registry._OWN.clear()  # as in another process
    with pytest.raises(WeightsError, match=f"no network is called 'Net'.*{OWN_NETWORKS}"):
        load_weights(weights)
    monkeypatch.setenv(OWN_NETWORKS, f'{network}:Net')
    assert type(load_weights(weights).reconstruction).__name__ == 'Net'


def test_a_network_is_given_the_cameras_that_the_page_describes():
    page = (EXAMPLE.parents[1] / 'doc' / 'extending.md').read_text()
    assert set(re.findall(r'`cameras\.(\w+)`', page)) == set(Cameras._fields)
    given = Cameras.of([orbit_camera(0.0)] * 3)
    assert [part.shape for part in given] == [(3, 4, 4), (3, 3, 3)]
    assert {part.dtype for part in given} == {torch.float64}


def test_a_file_that_has_no_network_is_refused(tmp_path):
    path = tmp_path / 'mine.py'
    path.write_text('Net = 3\n')
    with pytest.raises(ConfigError, match='neither a NetworkEntry nor'):
        named_network(f'{path}:Net')
    with pytest.raises(ConfigError, match='has no Other'):
        named_network(f'{path}:Other')
    with pytest.raises(ConfigError, match=r'which network .* Expected .*mine\.py:Net, where'):
        named_network(f'{path}')
    with pytest.raises(ConfigError, match='no such file'):
        load_from_file(f'{tmp_path}/none.py:Net')
    path.write_text('1 / 0\n')
    with pytest.raises(ConfigError, match='fails with ZeroDivisionError'):
        load_from_file(f'{path}:Net')


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Install a package that offers a network and a policy."""
    (tmp_path / 'mine.py').write_text(
        EXAMPLE.read_text() + '\nfrom active_recon.policies.geometric import FarthestPolicy\n'
        'class Near(FarthestPolicy):\n    pass\n'
        'class Needy(FarthestPolicy):\n    def __init__(self, weight): pass\n'
        'class Flat(Net):\n    def decode(self, state):\n        return state["latent"]\n')
    metadata = tmp_path / 'mine-1.0.dist-info'
    metadata.mkdir()
    (metadata / 'METADATA').write_text('Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n')
    (metadata / 'entry_points.txt').write_text(
        f'[{NETWORKS_GROUP}]\nmine = mine:Net\nflat = mine:Flat\nbroken = mine:Nothing\n'
        f'[{POLICIES_GROUP}]\nfar = mine:FarthestPolicy\nnear = mine:Near\nneedy = mine:Needy\n'
        'sizes = mine:Sizes\n')
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


def test_a_network_of_an_installed_package_is_tried_before_it_is_trained(
        package, dataset, tmp_path, monkeypatch, capsys):
    threads = torch.get_num_threads()
    line = refusal(monkeypatch, capsys, 'train', dataset, '--validation', dataset, '--out',
                   tmp_path / 'run', '--model', 'flat', '--threads', 1)
    torch.set_num_threads(threads)
    assert 'flat: wrong occupancy: expected logits (2, 32, 32, 32) of decode' in line


def test_what_an_installed_package_offers_as_a_policy_and_is_none_is_refused(package):
    with pytest.raises(ConfigError, match="needy: cannot be made: .* got TypeError: .*'weight'"):
        _installed('needy')(PolicyOptions())
    with pytest.raises(ConfigError, match='sizes: no policy: .* got a Sizes without wants_volume'):
        _installed('sizes')(PolicyOptions())


def test_what_is_kept_of_a_network_or_policy_of_one_s_own_is_that_of_its_code(
        package, views, tmp_path, monkeypatch):
    for name in ('near', 'far'):  # `far` is a class of ours that the package makes
        monkeypatch.setitem(POLICIES, name, PolicyEntry(_installed(name), ('seed',)))

    def kept():
        monkeypatch.delitem(sys.modules, 'mine', raising=False)
        entry = network_entry('mine')
        torch.manual_seed(0)
        trial = Trial(entry.build(entry.sizes['small']), 0.5, views, cache=tmp_path)
        return trial.folder, *(trial.cached(*contenders([name], seeds=1), 0).name
                               for name in ('near', 'far', 'random'))

    before = kept()
    assert kept() == before
    with (tmp_path / 'mine.py').open('a') as file:
        file.write('# another version\n')
    changed = [name != other for name, other in zip(kept(), before, strict=True)]
    assert changed == [True, True, True, False]


def test_a_policy_of_an_installed_package_is_measured_with_the_weights_where_it_is_named(
        package, monkeypatch, tmp_path):
    given = []
    monkeypatch.setitem(POLICIES, 'near', PolicyEntry(
        lambda options: given.append(options.weights) or FarthestPolicy()))
    assert 'near' not in heuristic_names()
    assert {'random', 'uniform', 'farthest'} <= set(heuristic_names())
    [own] = contenders(['near'], weights=tmp_path / 'weights.safetensors')
    own.make(np.random.default_rng(0))
    assert given == [tmp_path / 'weights.safetensors']


OWN = """
from my_network import Net, Sizes
from dataclasses import dataclass
from active_recon.config import Config
from active_recon.models.network import ReconstructionNetwork
import torch

class Unsaved(Net):
    def __init__(self, config):
        super().__init__(config)
        self.register_buffer('grid', torch.linspace(0, 1, 5), persistent=False)
        self.rates = torch.linspace(0, 0.1, 3).tolist()
        self.plain = torch.linspace(0, 1, 5)

class NoLatent(Net):
    def initial_state(self, batch):
        return {'seen': super().initial_state(batch)['latent']}

    def update(self, encoded, cameras, state):
        return {'seen': torch.maximum(state['seen'], encoded)}

    def decode(self, state):
        return super().decode({'latent': state['seen']})

class Flat(Net):
    def decode(self, state):
        return super().decode(state).flatten(1)

class NotFinite(Net):
    def decode(self, state):
        return super().decode(state) / 0

class NoDecode(Net):
    decode = ReconstructionNetwork.decode

class AnyCamera(Net):
    needs_front = False

class Adding(Net):
    def update(self, encoded, cameras, state):
        return {'latent': state['latent'].add_(encoded)}

class Replacing(Net):
    def update(self, encoded, cameras, state):
        state['latent'] = state['latent'] + 1
        return state

class Coarse(Net):
    resolution = 16

class NoSize(Net):
    image_size = None

class Counted(Net):
    def initial_state(self, batch):
        return {**super().initial_state(batch), 'views': torch.zeros(batch, dtype=torch.long)}

    def update(self, encoded, cameras, state):
        return super().update(encoded, cameras, state) | {'views': state['views'] + 1}

class Keeping(Net):
    def initial_state(self, batch):
        return {**super().initial_state(batch), 'all': torch.zeros(batch, 0, 16, 4, 4)}

    def update(self, encoded, cameras, state):
        every = torch.cat([state['all'], encoded[:, None]], dim=1)
        return {'latent': every.amax(dim=1), 'all': every}

class InDouble(Net):
    def update(self, encoded, cameras, state):
        moved = torch.eye(4, dtype=torch.float64) @ cameras.poses
        return super().update(encoded + moved[:, :1, :1, :1].float(), cameras, state)

class Shifted(torch.nn.GroupNorm):
    def forward(self, maps):
        return super().forward(maps) + 2

class Turning(Net):
    def __init__(self, config):
        super().__init__(config)
        self.look.insert(1, torch.nn.GroupNorm(4, 16, affine=False))
        self.look.insert(2, Shifted(4, 16))

    def update(self, encoded, cameras, state):
        turned = cameras.turned(torch.full((len(encoded),), 0.3)).azimuths
        return super().update(encoded + turned[:, None, None, None], cameras, state)

class Learned(Net):
    def __init__(self, config):
        super().__init__(config)
        self.prior = torch.nn.Parameter(torch.full((1, 32), 2.0))

    def initial_state(self, batch):
        return {**super().initial_state(batch), 'prior': torch.zeros(batch, 32)}

    def update(self, encoded, cameras, state):
        return super().update(encoded, cameras, state) | {
            'prior': self.prior if len(encoded) == 1 else self.prior.expand(len(encoded), -1)}

    def decode(self, state):
        return super().decode(state) + state['prior'][:, :, None, None]

class Needs(Net):
    @dataclass(frozen=True)
    class Config(Config):
        channels: int
"""


@pytest.fixture
def own_file(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLE.parent)
    path = tmp_path / 'own.py'
    path.write_text(OWN)
    return path


def test_a_network_with_tensors_that_are_not_stored_is_loaded(own_file, tmp_path, monkeypatch):
    monkeypatch.setenv(OWN_NETWORKS, f'{own_file}:AnyCamera, {own_file}:Unsaved')
    entry = network_entry('Unsaved')
    config = entry.sizes['small']
    network = entry.build(config)
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network, None, config, 0.5, model='Unsaved'))
    loaded = load_weights(path).reconstruction
    assert loaded.rates == network.rates
    for name in ('grid', 'plain'):
        torch.testing.assert_close(getattr(loaded, name), getattr(network, name))


@pytest.mark.slow
def test_a_network_of_a_file_is_known_to_the_processes_that_share_the_work(tmp_path):
    path = tmp_path / 'my net.v2.py'
    path.write_text(EXAMPLE.read_text())
    entry = network_entry(named_network(f'{path}:Net'))
    network = entry.build(entry.sizes['small'])
    [result] = LocalCrew(2).map(state_hash, [network])
    assert (result.value, result.refusal) == (state_hash(network), '')


def test_a_network_whose_resolution_no_data_have_is_not_compared(own_file, tmp_path, monkeypatch):
    monkeypatch.setenv(OWN_NETWORKS, f'{own_file}:Coarse')
    entry = network_entry('Coarse')
    config = entry.sizes['small']
    path = tmp_path / 'coarse.safetensors'
    save_weights(path, Bundle(entry.build(config), None, config, 0.5, model='Coarse'))
    with pytest.raises(ConfigError, match='coarse: no true voxels .* 32 or 64 cells .* got 16'):
        load_entrants(f'carving,{path}')


@pytest.mark.parametrize(('name', 'said'), [
    ('NoLatent', r'no latent: expected \(2, C, h, w\) .* got .*seen'),
    ('Flat', r'occupancy: expected logits \(2, 32, 32, 32\) of decode, got \(2, 32768\)'),
    ('NotFinite', r'no usable occupancy: expected finite logits .* got 65536 of 65536 NaN or inf'),
    ('NoDecode', r'cannot be built: expected a network of its Sizes\(channels=16\).*decode'),
    ('AnyCamera', r'on two views of \(2, 4, 64, 64\): RuntimeError'),
    ('Adding', 'the given state is modified: expected .* got other latent'),
    ('Replacing', 'the given state is modified: expected .* got other latent'),
    ('NoSize', r'expected image_size and resolution \(int\).*got None, 32 and True')])
def test_a_network_of_another_interface_is_refused_before_it_is_trained(
        name, said, own_file, dataset, tmp_path, monkeypatch, capsys):
    threads = torch.get_num_threads()
    line = refusal(monkeypatch, capsys, 'train', dataset, '--validation', dataset, '--out',
                   tmp_path / 'run', '--model', f'{own_file}:{name}', '--threads', 1)
    torch.set_num_threads(threads)
    assert re.search(rf'own\.py:{name}: .*{said}', line)


@pytest.mark.parametrize('name', NETWORKS)
def test_the_networks_of_this_package_pass_the_trial(name):
    entry = network_entry(name)
    try_network(entry.build(entry.sizes['small']).eval(), name)


@pytest.fixture
def own_weights(own_file, tmp_path, monkeypatch):
    def saved(name):
        monkeypatch.setenv(OWN_NETWORKS, f'{own_file}:{name}')
        torch.manual_seed(0)
        config = network_entry(name).sizes['small']
        path = tmp_path / f'{name}.safetensors'
        save_weights(path, Bundle(network_entry(name).build(config), None, config, 0.5,
                                  model=name))
        return path

    return saved


@pytest.mark.parametrize(('name', 'said'), [
    ('Counted', r"a state of float32 numbers .* 'views': 'int64 \(1,\)'"),
    ('Keeping', r'whose shapes no view changes.*\(1, 0, 16, 4, 4\).*\(1, 1, 16, 4, 4\)'),
    ('InDouble', 'cameras in float32, got: expected .* Double but found Float')])
def test_what_no_graph_can_run_is_not_exported(name, said, own_weights):
    pytest.importorskip('onnx')
    with pytest.raises(ConfigError, match=f'{name}: not exported: .*{said}'):
        export(own_weights(name))


@pytest.mark.parametrize('name', ['Turning', 'Learned'])
def test_own_norms_turned_cameras_and_weights_in_states_are_exported(name, own_weights):
    pytest.importorskip('onnx')
    pytest.importorskip('openvino')
    path = own_weights(name)
    export(path)
    camera = orbit_camera(1.2)
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    theirs, ours = (runtime.step(image, camera, runtime.initial_state())[1] for runtime in (
        load_runtime(path, library, precision='f32') for library in ('torch', 'openvino')))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-4)


def test_a_latent_that_is_changed_changes_no_view_that_comes(own_weights):
    reconstructor = Reconstructor.load(own_weights('Turning'), threads=1)
    image = np.random.default_rng(0).integers(0, 256, (137, 137, 3), np.uint8)
    reconstructor.add_view(image, orbit_camera(0.3))
    wanted = reconstructor.add_view(image, orbit_camera(1.3))
    reconstructor.reset()
    reconstructor.add_view(image, orbit_camera(0.3)).latent[:] = 7
    found = reconstructor.add_view(image, orbit_camera(1.3))
    np.testing.assert_array_equal(found.grid.occupancy, wanted.grid.occupancy)


def test_a_config_without_defaults_is_refused(own_file):
    with pytest.raises(ConfigError, match=r'own\.py:Needs: a Config without defaults.*channels'):
        named_network(f'{own_file}:Needs')
