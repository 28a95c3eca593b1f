"""Exported networks answer as torch does, whatever runs them, and bad files are refused."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
import json
import math
from pathlib import Path
import re
import shutil
import sys
from types import ModuleType

from active_recon.datasets.layout import list_objects, RENDERING
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import ConfigError, WeightsError
from active_recon.exporting.export import export
from active_recon.exporting.quantization import quantize
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, Intrinsics, orbit_camera
from active_recon.geometry.canonical import network_image
from active_recon.models.attention import AttentionModel
from active_recon.models.candidate_looks import look
from active_recon.models.registry import network_entry
from active_recon.models.scorer_weights import save_scorer
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import (
    find_weights,
    scorer_path,
    SHIPPED,
    weights_hash,
)
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import load_policy_runtime, load_runtime, REMARK
from active_recon.runtimes.compiled_cache import cache_folder, VARIABLE
from active_recon.runtimes.graph_files import (
    DECODE_PART,
    graph_path,
    INT8_PART,
    KEY,
    NETWORK_PARTS,
    POLICY_PART,
)
from active_recon.runtimes.precision import chosen_precision, has_bf16, has_int8
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou
from command_line import command
import numpy as np
import pytest
from recorded_messages import small_disk
import test_lifting
import test_network_laws
import test_view_scorer
import torch

onnx = pytest.importorskip('onnx')
pytest.importorskip('openvino')
pytest.importorskip('onnxruntime')

LIBRARIES = ('openvino', 'onnxruntime')
# The weights of which every answer is compared with torch's
COMPARED = ['lifting', 'carving', '2d3d-attention', 'shipped', *(
    pytest.param(name, marks=pytest.mark.slow)
    for name in ('plain', 'r2n2', 'ptn', '2d3d-posed', 'large'))]


def saved(folder, model, config, attention=None):
    """Return the weights file of a network with fresh weights, exported."""
    torch.manual_seed(0)
    network = network_entry(model).build(config).eval()
    path = folder / f'{model}.safetensors'
    save_weights(path, Bundle(network, attention, config, 0.4, model=model))
    export(path)
    return path


@pytest.fixture(scope='module')
def exported(tmp_path_factory, tiny):
    """Return what gives the weights file of a network, its graphs beside it."""
    folder = tmp_path_factory.mktemp('exported')
    sizes = test_network_laws.TINY | {
        'lifting': replace(test_lifting.TINY, visibility=True),
        'carving': network_entry('carving').sizes['small']}

    @cache
    def found(model):
        if model == 'shipped':
            return SHIPPED
        if model == 'large':
            return find_weights('lifting-large')
        if model == 'plain':
            return saved(folder / 'plain', 'lifting', test_lifting.TINY)
        if model == '2d3d-attention':
            return saved(folder, model, tiny, AttentionModel.from_config(tiny))
        return saved(folder, model, sizes[model])

    return found


def some_views(spec, count=3):
    """Return images of noise before white, and the cameras that took them."""
    rng = np.random.default_rng(0)
    for number in range(count):
        image = np.full((spec.image_size, spec.image_size, 3), 255, np.uint8)
        third = spec.image_size // 3
        image[third:2 * third, third - 9 * number:2 * third] = rng.integers(
            0, 200, (third, third + 9 * number, 3))
        size = spec.image_size
        lens = (CANONICAL_INTRINSICS.resized(size, size) if spec.needs_front else
                Intrinsics(1.1 * size, 1.1 * size, size / 2, size / 2 + number, size, size))
        if number == 2 and not spec.needs_front:
            seen = np.full((*image.shape[:2], 1), 255, np.uint8)
            seen[:, :third] = 0
            image = np.dstack([image * (seen > 0), seen])
        yield image, orbit_camera(
            0.3 + 1.7 * number, 0.5 if spec.needs_front else 0.2 * number, 2.1, lens)


def answers(runtime):
    """Return occupancies, latents and the last state over some views."""
    state, found = runtime.initial_state(), []
    for image, camera in some_views(runtime.spec):
        occupancy, latent, state = runtime.step(image, camera, state)
        found.append((occupancy, latent))
    return *map(np.array, zip(*found, strict=True)), state


@pytest.mark.parametrize('library', LIBRARIES)
@pytest.mark.parametrize('model', COMPARED)
def test_a_runtime_answers_as_torch_does_after_every_view(exported, model, library):
    theirs, ours = (load_runtime(exported(model), name, threads=1, precision='f32')
                    for name in ('torch', library))
    assert (ours.spec, ours.threshold) == (theirs.spec, theirs.threshold)
    expected, found = answers(theirs), answers(ours)
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-3)
    np.testing.assert_allclose(found[1], expected[1], rtol=0, atol=1e-3)
    assert np.ptp(found[0]) > 1e-3
    assert found[2].keys() == expected[2].keys()
    for name, part in expected[2].items():
        np.testing.assert_allclose(found[2][name], part, rtol=1e-4, atol=5e-3, err_msg=name)
    assert {key: ours.provenance[key] for key in ('weights_sha256', 'config_sha256')} == {
        key: theirs.provenance[key] for key in ('weights_sha256', 'config_sha256')}
    assert ours.provenance['computed_by'].startswith(f'{library} ')


@pytest.mark.parametrize('library', LIBRARIES)
def test_threads_may_share_a_network(exported, library):
    runtime = load_runtime(exported('ptn'), library, threads=1)
    image, camera = next(some_views(runtime.spec))
    expected = runtime.step(image, camera, runtime.initial_state())[0]
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda _: runtime.step(
            image, camera, runtime.initial_state())[0], range(24)))
    assert all(np.array_equal(each, expected) for each in found)


@pytest.mark.parametrize('library', LIBRARIES)
def test_a_state_is_passed_and_not_kept_nor_changed(exported, library):
    runtime = load_runtime(exported('lifting'), library, threads=1)
    first, second, _ = some_views(runtime.spec)
    _, _, state = runtime.step(*first, runtime.initial_state())
    before = {name: part.copy() for name, part in state.items()}
    for part in state.values():
        part.setflags(write=False)
    once = runtime.step(*second, state)[0]
    runtime.step(*first, state)
    np.testing.assert_array_equal(runtime.step(*second, state)[0], once)
    for name, part in before.items():
        np.testing.assert_array_equal(state[name], part)


@pytest.mark.skipif(not has_bf16(), reason='this processor has no bf16')
def test_half_precision_moves_hardly_a_cell():
    exact, half = (answers(load_runtime(None, 'openvino', threads=1, precision=precision))[0]
                   for precision in ('f32', 'bf16'))
    assert 0 < np.abs(half - exact).max() < 0.05
    assert np.abs(half - exact).mean() < 1e-3


def occupied(precision, weights=None):
    """Return what is occupied, (views, 64, 64, 64), after each of some views of the chair."""
    runtime = load_runtime(weights, 'openvino', threads=1, precision=precision)
    renderer = Renderer(load_mesh(SHIPPED.parents[1] / 'objects' / 'chair.glb'))
    state, found = runtime.initial_state(), []
    for azimuth in (0.3, 2.0, 4.0):
        camera = orbit_camera(azimuth)
        image = composite(renderer.render(camera), 255)
        occupancy, _, state = runtime.step(*network_image(image, camera, runtime.spec), state)
        found.append(occupancy > runtime.threshold)
    return np.array(found), runtime.provenance['computed_by']


@pytest.mark.skipif(not has_int8(), reason='this processor has no sums of 8-bit products')
def test_integers_hardly_change_an_object():
    (exact, _), (found, told) = occupied('f32'), occupied('int8')
    assert ', int8 with ' in told
    assert 0 < (found != exact).sum() < 0.1 * exact.sum()
    assert all(iou(*pair) > 0.9 for pair in zip(found, exact, strict=True))


def test_the_integers_that_ship_belong_to_the_weights_that_ship():
    whole, integers = (metadata(onnx.load(graph_path(None, part)))
                       for part in (DECODE_PART, INT8_PART))
    assert (integers.pop('part'), whole.pop('part')) == (INT8_PART, DECODE_PART)
    assert integers == whole
    assert whole['weights_sha256'] == weights_hash()


@pytest.mark.skipif(not has_int8(), reason='this processor has no sums of 8-bit products')
def test_weights_without_integers_are_told_and_auto_goes_on_without_them(exported):
    with pytest.raises(WeightsError, match='not quantised: expected lifting-decode-int8.onnx bes'):
        load_runtime(exported('lifting'), 'openvino', precision='int8')
    instead = load_runtime(exported('lifting'), precision='int8', threads=1).provenance
    assert instead['computed_by'].startswith('openvino') and 'int8' not in instead['computed_by']
    assert 'not quantised' in instead[REMARK]


@pytest.mark.parametrize('numbers', ['bf16', 'int8'])
def test_auto_keeps_to_the_export_where_the_processor_lacks_the_precision(monkeypatch, numbers):
    monkeypatch.setattr('active_recon.runtimes.precision._flags', frozenset)
    for load in (load_runtime, load_policy_runtime):
        instead = load(precision=numbers, threads=1).provenance
        assert re.match('openvino .*, f32, ', instead['computed_by'])
        assert instead[REMARK].startswith(f'the precision auto instead of {numbers}: precision: ')


@pytest.mark.parametrize(('model', 'words'), [
    ('ptn', 'ptn: not quantised: expected the network lifting'),
    ('lifting', r"nncf is not installed: expected it, as `pip install 'active_recon\[int8\]'`")])
def test_another_network_is_not_quantised_nor_anything_without_nncf(
        exported, monkeypatch, model, words):
    monkeypatch.setitem(sys.modules, 'nncf', None)
    with pytest.raises(ConfigError, match=words):
        quantize(exported(model), [])


def test_integers_are_made_from_the_graphs_of_the_folder_that_is_named(
        exported, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'nncf', ModuleType('nncf'))
    for file in exported('lifting').parent.glob('lifting.*'):
        shutil.copy(file, tmp_path)
    with pytest.raises(AttributeError, match='nncf'):  # all that comes before it was read
        quantize(tmp_path / 'lifting.safetensors', [], exported('lifting').parent)


@pytest.mark.slow
def test_integers_of_weights_that_are_not_exported_are_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'nncf', ModuleType('nncf'))
    weights = tmp_path / SHIPPED.name
    shutil.copy(SHIPPED, weights)
    with pytest.raises(WeightsError, match='not exported: expected '
                                           f'{SHIPPED.stem}-encode.onnx beside'):
        quantize(weights, [])


def test_integers_made_anew_hardly_change_an_object(tmp_path):
    pytest.importorskip('nncf', reason="needs nncf: pip install 'active_recon[int8]'")
    for path in SHIPPED.parent.glob('lifting*'):
        shutil.copy(path, tmp_path)
    list(make_dataset(shape_jobs('chair', range(8), tmp_path / 'data'), 1))
    weights = tmp_path / SHIPPED.name
    made = quantize(weights, list_objects(tmp_path / 'data'))
    assert made == graph_path(weights, INT8_PART)
    found, exact = occupied('int8', weights)[0], occupied('f32')[0]
    assert all(iou(*pair) > 0.9 for pair in zip(found, exact, strict=True))


@pytest.mark.parametrize('library', LIBRARIES)
@pytest.mark.parametrize(('episodes', 'count', 'views'), [(1, 24, 1), (2, 5, 3), (1, 1, 9)])
def test_a_runtime_scores_any_candidates_as_torch_does(library, episodes, count, views):
    rng = np.random.default_rng(count)
    volume = test_view_scorer.coarse_volume(np.stack(
        [test_view_scorer.some_volume(seed) for seed in range(episodes)]))
    taken = np.repeat(test_view_scorer.poses(rng.uniform(0, 6, views)), episodes, 0)
    looks = look(volume.occupancy, volume.entropy, taken,
                 test_view_scorer.poses(rng.uniform(0, 6, count), rng.uniform(-1, 1, count)))
    expected, found = (load_policy_runtime(None, name, threads=1).step(looks._asdict(), {})[0]
                       for name in ('torch', library))
    np.testing.assert_allclose(found['gain'], expected['gain'], rtol=0, atol=1e-5)
    assert found['gain'].shape == (episodes, count)


@pytest.mark.parametrize('library', LIBRARIES)
def test_a_runtime_proposes_as_torch_does_after_every_view(exported, library):
    theirs, ours = (load_policy_runtime(exported('2d3d-attention'), name, threads=1)
                    for name in ('torch', library))
    assert ours.facts['view_separation'] == theirs.facts['view_separation']
    shape = theirs.facts['latent_shape']
    assert tuple(ours.facts['latent_shape']) == shape
    states = [runtime.initial_state(2) for runtime in (theirs, ours)]
    rng = np.random.default_rng(0)
    for azimuth in (0.0, 2.5, 6.0):
        told = {'latent': rng.normal(size=(2, *shape)).astype(np.float32),
                'azimuth': np.array([azimuth, azimuth / 2], np.float32)}
        (expected, states[0]), (found, states[1]) = (
            runtime.step(told, state) for runtime, state in zip((theirs, ours), states,
                                                                 strict=True))
        np.testing.assert_allclose(found['mean_azimuth'], expected['mean_azimuth'], atol=1e-4)
    np.testing.assert_allclose(states[1]['memory'], states[0]['memory'], atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(('model', 'most'), [('lifting', 5e6), ('lifting-large', 12e6)])
def test_what_ships_is_what_the_command_makes(model, most, tmp_path):
    weights = find_weights(model)
    for path in (weights, scorer_path(weights)):
        shutil.copy(path, tmp_path)
    made = export(tmp_path / weights.name)
    assert [path.name for path in made] == [
        graph_path(weights, part).name for part in (*NETWORK_PARTS, POLICY_PART)]
    for path in made:
        ours, theirs = (onnx.load(each) for each in (path, weights.with_name(path.name)))
        assert metadata(ours) == metadata(theirs)
        assert metadata(ours)['weights_sha256'] == weights_hash(weights)
        assert max(each.ByteSize() for each in (ours, theirs)) < most
    again, shipped = (load_runtime(each, 'openvino', threads=1)
                      for each in (tmp_path / weights.name, weights))
    np.testing.assert_allclose(answers(again)[0], answers(shipped)[0], rtol=0, atol=1e-5)


@pytest.mark.parametrize('model', ['ogn', 'shape-basis'])
def test_a_network_that_no_graph_can_hold_says_so_in_a_line(tmp_path, model):
    config = test_network_laws.TINY[model]
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network_entry(model).build(config), None, config, 0.4, model=model))
    with pytest.raises(ConfigError, match=f'{model}: not exported: .*; it runs with the runtime '
                                          'torch') as refused:
        export(path)
    assert '\n' not in str(refused.value)
    assert load_runtime(path).provenance['computed_by'].startswith('torch')
    assert REMARK not in load_runtime(path).provenance


def test_the_command_writes_the_files_where_it_is_told_or_says_why_not(
        exported, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, 'export', exported('ptn'), tmp_path / 'new') == 0
    names = [path.name for path in sorted((tmp_path / 'new').iterdir())]
    assert names == ['ptn-decode.onnx', 'ptn-encode.onnx', 'ptn-update.onnx']
    told = capsys.readouterr().out
    assert all(f'wrote {tmp_path / "new" / name}' in told for name in names)
    assert command(monkeypatch, 'export', 'ogn', tmp_path) == 2
    assert 'ogn: not exported' in capsys.readouterr().err
    (tmp_path / 'file').touch()
    with monkeypatch.context() as untraced:
        untraced.setattr(torch.onnx, 'export', None)
        assert command(untraced, 'export', exported('ptn'), tmp_path / 'file') == 2
    assert f'{tmp_path / "file"}: cannot be written: expected a folder that files can be made' in (
        capsys.readouterr().err)
    monkeypatch.setitem(sys.modules, 'onnx', None)
    assert command(monkeypatch, 'export', exported('ptn'), tmp_path) == 2
    assert "onnx is not installed: expected it, as `pip install 'active_recon[export]'`" in (
        capsys.readouterr().err)


def test_a_folder_without_objects_to_take_ranges_of_is_refused_before_anything_is_written(
        exported, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'nncf', ModuleType('nncf'))
    (tmp_path / 'new').mkdir()
    assert command(monkeypatch, 'export', exported('lifting'), tmp_path / 'new', '--int8',
                   tmp_path / 'none') == 2
    assert "none: no dataset in R2N2's layout" in capsys.readouterr().err
    (tmp_path / 'empty' / RENDERING).mkdir(parents=True)
    assert command(monkeypatch, 'export', exported('lifting'), tmp_path / 'new', '--int8',
                   tmp_path / 'empty') == 2
    assert 'empty: no objects: expected some training objects' in capsys.readouterr().err
    assert not list((tmp_path / 'new').iterdir())


def test_graphs_are_written_whole_or_those_before_stay(exported):
    weights = exported('ptn')
    before = {path: path.read_bytes() for path in weights.parent.glob('ptn*')}
    with small_disk(1000), pytest.raises(OSError):
        export(weights)
    assert {path: path.read_bytes() for path in weights.parent.glob('*ptn*')} == before


def metadata(model):
    return json.loads({each.key: each.value for each in model.metadata_props}[KEY])


@pytest.fixture
def broken(exported, tmp_path):
    """Return a copy of exported weights, and what changes one of its files."""
    for path in exported('ptn').parent.glob('ptn*'):
        if path.is_file():
            shutil.copy(path, tmp_path)
    weights = tmp_path / 'ptn.safetensors'

    def change(part, how):
        path = graph_path(weights, part)
        if callable(how):
            path.write_bytes(how(path.read_bytes()))
            return weights
        model = onnx.load(path)
        told = metadata(model) | how
        model.metadata_props[0].value = json.dumps(told)
        onnx.save(model, path)
        return weights

    return change


FAULTS = [
    ('update', lambda data: data[:len(data) // 2], 'no whole ONNX file'),
    ('decode', lambda data: b'', 'no whole ONNX file'),
    ('encode', {'weights_sha256': 'f' * 64}, 'exported from other weights: expected .*, got fff'),
    ('encode', {'part': 'decode'}, 'another part of a network: expected encode, got decode'),
    ('update', {'format': 99}, 'another format of exported files: expected 2, got 99; export'),
    ('update', {'state': {'hull': [[2, 32, 32, 32], 0.0]}}, 'contradicts its metadata: expected'),
    ('update', {'state': 7}, 'its metadata cannot be read'),
    ('decode', {'facts': {'resolution': 8}}, 'exported at another time than the parts beside'),
]


@pytest.mark.parametrize(('part', 'how', 'words'), FAULTS, ids=lambda value: str(value)[:20])
def test_a_bad_file_is_one_line_and_torch_goes_on_without_it(broken, part, how, words):
    weights = broken(part, how)
    for library in LIBRARIES:
        with pytest.raises(WeightsError, match=words) as refused:
            load_runtime(weights, library, threads=1)
        assert '\n' not in str(refused.value)
        assert str(graph_path(weights, 'x').parent) in str(refused.value)
    instead = load_runtime(weights, threads=1)
    assert instead.provenance['computed_by'].startswith('torch')
    assert instead.provenance[REMARK].startswith('the runtime torch instead of openvino: ')


@pytest.mark.parametrize(('name', 'value'), [
    ('threshold', None), ('image_size', '32'), ('resolution', '64'), ('needs_front', 'no')])
def test_files_that_lack_a_fact_of_their_network_are_one_line_and_torch_goes_on(
        broken, exported, name, value):
    facts = metadata(onnx.load(graph_path(exported('ptn'), 'update')))['facts']
    for part in NETWORK_PARTS:
        weights = broken(part, {'facts': facts | {name: value}})
    for library in LIBRARIES:
        with pytest.raises(WeightsError, match=f'expected {name} as .*, got {value!r}'):
            load_runtime(weights, library, threads=1)
    assert f'expected {name} as ' in load_runtime(weights, threads=1).provenance[REMARK]


def test_another_file_of_onnx_is_refused(broken):
    def bare(data):
        model = onnx.load_from_string(data)
        del model.metadata_props[:]
        return model.SerializeToString()

    weights = broken('encode', bare)
    for library in LIBRARIES:
        with pytest.raises(WeightsError, match='says nothing of active_recon: expected a file'):
            load_runtime(weights, library, threads=1)


@pytest.mark.parametrize('library', LIBRARIES)
def test_weights_that_were_not_exported_are_told_with_what_to_do(tmp_path, library):
    weights = shutil.copy(SHIPPED, tmp_path)
    with pytest.raises(WeightsError, match=f'not exported: expected {SHIPPED.stem}-encode.onnx '
                                           'beside it, which `active-recon export` makes'):
        load_runtime(tmp_path / SHIPPED.name, library)
    assert REMARK not in load_runtime(tmp_path / SHIPPED.name).provenance, weights


@pytest.mark.parametrize(('library', 'wrong', 'words'), [
    ('openvino', {'precision': 'half'}, 'precision: unknown value: expected one of auto, f32'),
    ('openvino', {'device': 'cuda'}, 'device: not for exported graphs: expected cpu, got cuda'),
    ('onnxruntime', {'precision': 'bf16'}, 'bf16 is not for the runtime onnxruntime'),
    ('onnxruntime', {'precision': 'int8'}, 'int8 is not for the runtime onnxruntime'),
    ('onnxruntime', {'device': 'cuda'}, 'device: cuda not available: expected one that this'),
    ('torch', {'precision': 'bf16'}, 'bf16 is not for the runtime torch'),
    ('torch', {'device': 'gpu'}, "device: unknown value: expected one of torch.*, got 'gpu'"),
    ('auto', {'threads': -1}, 'threads: too few: expected 1 or more, got -1'),
    ('torch', {'threads': 0}, 'threads: too few: expected 1 or more, got 0'),
    ('tensorflow', {}, 'runtime: unknown value: expected one of auto, openvino, torch, onnxr')])
def test_what_a_runtime_has_not_is_refused(library, wrong, words):
    with pytest.raises(ConfigError, match=words):
        load_runtime(None, library, **wrong)


TENSORRT, CUDA, CPU = (f'{name}ExecutionProvider' for name in ('Tensorrt', 'CUDA', 'CPU'))


def pretend(monkeypatch, taken):
    """Let ONNX Runtime be built for graphics cards, and take other providers than it is told."""
    import onnxruntime

    class Session(onnxruntime.InferenceSession):
        def __init__(self, path, options, providers):
            assert providers == [TENSORRT, CUDA]
            super().__init__(path, options, providers=[CPU])

        def get_providers(self):
            return taken

    monkeypatch.setattr(onnxruntime, 'InferenceSession', Session)
    monkeypatch.setattr(onnxruntime, 'get_available_providers', lambda: [TENSORRT, CUDA, CPU])


def test_a_graphics_card_whose_libraries_are_missing_is_refused(exported, monkeypatch):
    pretend(monkeypatch, [CPU])
    with pytest.raises(ConfigError, match='device: cuda cannot be used: expected .*took CPU'):
        load_runtime(exported('ptn'), 'onnxruntime', 'cuda')


def test_what_onnx_runtime_took_is_told_and_not_what_it_was_to_take(exported, monkeypatch):
    pretend(monkeypatch, [CUDA, CPU])
    told = load_runtime(exported('ptn'), 'onnxruntime', 'cuda', 1).provenance['computed_by']
    assert told.endswith(', f32, CUDA, 1 threads')


@pytest.mark.parametrize(('precision', 'expected'), [
    ('bf16', 'avx512_bf16'), ('int8', 'avx512_vnni, avx_vnni or amx_int8')])
def test_what_the_processor_would_imitate_is_refused(monkeypatch, precision, expected):
    monkeypatch.setattr('active_recon.runtimes.precision._flags', lambda: frozenset({'avx2'}))
    with pytest.raises(ConfigError, match=f'{precision} is not in this processor: expected '
                                          f'{expected}'):
        load_runtime(None, 'openvino', precision=precision)


@pytest.mark.parametrize(('has', 'expected'), [('amx_bf16', 'bf16'), ('avx512f', 'f32')])
def test_a_network_is_computed_in_bf16_where_the_processor_has_it(monkeypatch, has, expected):
    monkeypatch.setattr('active_recon.runtimes.precision._flags', lambda: frozenset({has}))
    assert chosen_precision('auto') == expected


@pytest.mark.parametrize('library', LIBRARIES)
def test_a_library_that_is_not_installed_is_named(monkeypatch, library):
    monkeypatch.setitem(sys.modules, library, None)
    if library == 'openvino':
        from active_recon.runtimes.openvino import _core
        _core.cache_clear()
    with pytest.raises(ConfigError, match=f'runtime: {library} is not installed: expected it'):
        load_runtime(None, library)
    if library == 'openvino':
        assert 'not installed' in load_runtime().provenance[REMARK]


def test_a_damaged_cache_is_made_anew(exported, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    weights = exported('ptn')
    expected = answers(load_runtime(weights, 'openvino', threads=1))[0]
    kept = sorted(tmp_path.rglob('*.bin'))
    whole = [path.read_bytes() for path in kept]
    assert len(kept) == len(NETWORK_PARTS)
    for spoil in (lambda data: data[:-9], lambda data: b'', lambda data: data[:-1] + b'\xff\xfe'):
        for path, data in zip(kept, whole, strict=True):
            path.write_bytes(spoil(data))
        found = answers(load_runtime(weights, 'openvino', threads=1))[0]
        np.testing.assert_array_equal(found, expected)
        assert sorted(tmp_path.rglob('*.bin')) == kept
        assert min(path.stat().st_size for path in kept) > 1000
    found = answers(load_runtime(weights, 'openvino', threads=1))[0]  # what was kept
    np.testing.assert_array_equal(found, expected)


def test_a_cache_that_cannot_be_written_is_done_without(exported, tmp_path, monkeypatch):
    (tmp_path / 'file').write_text('no folder')
    for place in (tmp_path / 'file' / 'below', ''):
        monkeypatch.setenv(VARIABLE, str(place))
        told = load_runtime(exported('ptn'), threads=1).provenance
        assert told['computed_by'].startswith('openvino')
        assert ('compiled networks cannot be kept there: ' in told.get(REMARK, '')) == bool(place)
        assert '\n' not in told.get(REMARK, '')


def test_a_cache_may_be_read_by_others_as_what_else_is_written(exported, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    (tmp_path / 'other').touch()
    load_runtime(exported('ptn'), 'openvino', threads=1)
    assert {path.stat().st_mode for path in tmp_path.rglob('*') if path.is_file()} == {
        (tmp_path / 'other').stat().st_mode}


def test_a_cache_may_be_named_from_the_user_s_home(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.setenv(VARIABLE, '~/kept')
    assert cache_folder() == tmp_path / 'kept'


def test_a_user_without_a_home_keeps_nothing_that_was_compiled(exported, monkeypatch):
    def without_home(path):
        raise RuntimeError('Could not determine home directory.')

    for variable in (VARIABLE, 'XDG_CACHE_HOME'):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(Path, 'expanduser', without_home)
    assert load_runtime(exported('ptn'), 'openvino', threads=1).provenance


def test_a_scorer_trained_since_the_export_is_not_mistaken_for_the_exported_one(tmp_path):
    for path in (SHIPPED, scorer_path(), graph_path(None, POLICY_PART)):
        shutil.copy(path, tmp_path)
    weights = tmp_path / SHIPPED.name
    torch.manual_seed(1)
    config = ScorerConfig(4, 8, 1)
    save_scorer(scorer_path(weights), ViewScorer.from_config(config), config, weights_hash(), {})
    with pytest.raises(WeightsError, match='exported from another view policy'):
        load_policy_runtime(weights, 'openvino')
    assert load_policy_runtime(weights).provenance['computed_by'].startswith('torch')


def test_the_reconstructor_runs_what_is_asked_for(exported):
    for library in ('torch', *LIBRARIES):
        loaded = Reconstructor.load(exported('ptn'), runtime=library, threads=1)
        assert loaded.provenance['computed_by'].startswith(f'{library} ')
    assert math.isclose(loaded.threshold, 0.4)
