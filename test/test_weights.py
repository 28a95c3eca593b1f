"""Weights on disk: what was saved is loaded, and everything else is refused in words."""

import json
import math
import os
from pathlib import Path

from active_recon.errors import WeightsError
from active_recon.models.scorer_weights import save_scorer
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.models.weights import Bundle, load_weights, save_weights
from active_recon.models.weights_files import (
    DEFAULT_MODEL,
    find_weights,
    PAPER_MODEL,
    read_card,
    SHIPPED,
    weights_hash,
)
import numpy as np
import pytest
from recorded_messages import small_disk
from safetensors.torch import load_file, save_file
from shown_views import known_after
import torch
from torch import nn
from torch.testing import assert_close


@pytest.fixture
def saved(tmp_path, network, attention, tiny) -> Path:
    path = tmp_path / 'run' / 'weights.safetensors'
    save_weights(path, Bundle(network, attention, tiny, 0.35, {'command': 'made by a test'}))
    return path


def rewritten(path, tiny, tensors=None, **metadata):
    """Write the file again with other tensors or metadata; None leaves a key out."""
    told = {'model': PAPER_MODEL, 'config': json.dumps(tiny.to_dict()),
            'threshold': '0.35'} | metadata
    save_file(load_file(path) if tensors is None else tensors, path,
              {key: value for key, value in told.items() if value is not None})


def test_what_was_saved_is_loaded_to_half_precision(saved, network, attention, tiny):
    bundle = load_weights(saved)
    assert (bundle.config, bundle.threshold) == (tiny, 0.35)
    for loaded, module in ((bundle.reconstruction, network), (bundle.attention, attention)):
        for name, tensor in module.state_dict().items():
            assert_close(loaded.state_dict()[name], tensor, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize('number', [math.nan, math.inf])
def test_weights_with_numbers_that_are_not_finite_are_refused_and_named(saved, tiny, number):
    tensors = load_file(saved)
    name = next(name for name in tensors if name.startswith('reconstruction'))
    tensors[name].view(-1)[0] = number
    rewritten(saved, tiny, tensors)
    with pytest.raises(WeightsError, match=f'not finite: expected finite numbers in {name}'):
        load_weights(saved)


def test_the_same_weights_are_written_as_the_same_bytes(saved, network, attention, tiny, tmp_path):
    for number in range(8):  # safetensors draws the order of the metadata anew each time
        again = tmp_path / f'{number}.safetensors'
        save_weights(again, Bundle(network, attention, tiny, 0.35))
        assert again.read_bytes() == saved.read_bytes()


def test_a_loaded_network_answers_as_the_one_that_was_saved(saved, network):
    images = torch.rand(2, 3, 64, 64)
    with torch.no_grad():
        expected = known_after(network, images[None])
    found = known_after(load_weights(saved).reconstruction, images[None])
    assert_close(found.logits, expected.logits, rtol=0, atol=0.01)


WRITERS = pytest.mark.parametrize('write', [
    lambda path, bundle: save_weights(path, bundle),
    lambda path, _: save_scorer(
        path, ViewScorer.from_config(ScorerConfig()), ScorerConfig(), 'a' * 64, {})],
    ids=['network', 'policy'])


@WRITERS
def test_weights_are_written_whole_or_those_before_stay(write, saved, network, tiny):
    before = {path: path.read_bytes() for path in saved.parent.iterdir()}
    with small_disk(1000), pytest.raises(OSError):
        write(saved, Bundle(network, None, tiny, 0.5))
    assert {path: path.read_bytes() for path in saved.parent.iterdir()} == before


@WRITERS
def test_weights_whose_card_cannot_be_written_are_not_written(write, network, tiny, tmp_path):
    card = tmp_path / 'weights.json'
    card.mkdir()
    with pytest.raises(OSError, match=card.name):
        write(card.with_suffix('.safetensors'), Bundle(network, None, tiny, 0.5))
    assert list(tmp_path.iterdir()) == [card]


def test_loaded_networks_are_frozen_and_in_float32(saved):
    bundle = load_weights(saved)
    for module in (bundle.reconstruction, bundle.attention):
        assert not module.training
        for parameter in module.parameters():
            assert not parameter.requires_grad
            assert parameter.dtype == torch.float32
            assert parameter.device.type == 'cpu'


def test_a_second_saving_of_what_was_loaded_loses_nothing(saved, tmp_path):
    again = tmp_path / 'again.safetensors'
    save_weights(again, load_weights(saved))
    assert_close(load_file(again), load_file(saved), rtol=0, atol=0)


def test_the_card_beside_tells_where_the_weights_come_from(saved, tiny):
    card = json.loads(saved.with_suffix('.json').read_text())
    assert card['command'] == 'made by a test'
    assert card['sha256'] == weights_hash(saved)
    assert card['threshold'] == 0.35
    assert card['config'] == json.loads(json.dumps(tiny.to_dict()))


@pytest.mark.parametrize('text', ['{"sha256": ', '[1]', '\xff'])
def test_a_damaged_card_is_refused_by_its_name(saved, text):
    saved.with_suffix('.json').write_bytes(text.encode('latin-1'))
    with pytest.raises(WeightsError, match=f'{saved.stem}.json: no readable card: expected the'):
        read_card(saved)


def test_nothing_in_the_file_is_a_pickle(saved):
    raw = saved.read_bytes()
    header = int.from_bytes(raw[:8], 'little')
    assert json.loads(raw[8:8 + header])['__metadata__']['model'] == PAPER_MODEL
    numbers = sum(tensor.nbytes for tensor in load_file(saved).values())
    assert len(raw) == 8 + header + numbers  # a header in JSON, and numbers


def test_the_weights_that_ship_load_and_know_their_hash():
    bundle = load_weights()
    assert 0 < bundle.threshold < 1
    assert weights_hash() == bundle_card()['sha256']


def test_a_file_is_read_once_for_its_hash_until_another_is_in_its_place(tmp_path, monkeypatch):
    path, other = tmp_path / 'a.safetensors', tmp_path / 'b.safetensors'
    path.write_bytes(b'one')
    first = weights_hash(path)
    with monkeypatch.context() as patch:
        patch.delattr(Path, 'read_bytes')
        assert weights_hash(path) == first
    other.write_bytes(b'two')
    os.replace(other, path)
    second = weights_hash(path)
    assert second != first
    path.write_bytes(b'three')
    assert weights_hash(path) not in (first, second)


def bundle_card():
    import active_recon
    return json.loads(
        (Path(active_recon.__file__).parent / 'weights' / f'{DEFAULT_MODEL}.json').read_text())


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(WeightsError, match=r'nothing\.safetensors: no such file'):
        load_weights(tmp_path / 'nothing.safetensors')


@pytest.mark.parametrize('share', [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_file_is_refused(saved, share):
    raw = saved.read_bytes()
    saved.write_bytes(raw[:int(share * len(raw))])
    with pytest.raises(WeightsError, match='no whole safetensors file'):
        load_weights(saved)


def test_a_pickle_is_refused_and_never_run(tmp_path):
    torch.save({'weights': torch.zeros(3)}, tmp_path / 'model.safetensors')
    with pytest.raises(WeightsError, match='no whole safetensors file'):
        load_weights(tmp_path / 'model.safetensors')


@pytest.mark.parametrize(('model', 'said'), [
    ('3d-r2n3', "'3d-r2n3': expected one of 2d3d-attention"),
    (None, 'names no model')])
def test_a_model_that_is_not_in_the_registry_is_refused(saved, tiny, model, said):
    rewritten(saved, tiny, model=model)
    with pytest.raises(WeightsError, match=said):
        load_weights(saved)


@pytest.mark.parametrize(('name', 'kind'), [
    ('segmenter', 'segmenter'), ('lifting-scorer', 'view-scorer'),
    ('lifting-depth', 'depth-refiner')])
def test_what_goes_with_a_network_is_told_where_a_network_is_meant(name, kind):
    with pytest.raises(WeightsError, match=f'of a reconstruction network.* got that of a {kind}$'):
        load_weights(find_weights(name))


def test_weights_without_a_view_policy_are_weights_too(tmp_path, network, tiny):
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network, None, tiny, 0.35, model='2d3d'))
    bundle = load_weights(path)
    assert bundle.attention is None
    assert bundle.model == '2d3d'


def test_weights_are_found_by_the_name_of_a_model_or_by_their_path(tmp_path):
    assert find_weights() == find_weights(DEFAULT_MODEL) == SHIPPED
    assert find_weights(tmp_path / 'a.safetensors') == tmp_path / 'a.safetensors'
    assert find_weights('runs/mine') == Path('runs/mine')
    with pytest.raises(WeightsError, match=f'2d4d: neither.*{DEFAULT_MODEL}'):
        find_weights('2d4d')


@pytest.mark.parametrize('config', [
    None, 'no json', '{"depth": 3}', '{"stem_channels": 0}', '{"decoder_channels": [8]}',
    '{"stem_channels": "many"}', '[1]'])
def test_a_config_that_makes_no_network_is_refused(saved, tiny, config):
    rewritten(saved, tiny, config=config)
    with pytest.raises(WeightsError, match='its config cannot be read'):
        load_weights(saved)


@pytest.mark.parametrize('threshold', [None, 'high', 'nan', 'inf', '-0.1', '35'])
def test_a_threshold_that_is_no_share_is_refused(saved, tiny, threshold):
    rewritten(saved, tiny, threshold=threshold)
    with pytest.raises(WeightsError, match='its config cannot be read'):
        load_weights(saved)


def test_tensors_of_other_sizes_than_the_config_are_refused(saved, tiny):
    other = json.dumps(tiny.to_dict() | {'recurrent_channels': 16})
    rewritten(saved, tiny, config=other)
    with pytest.raises(WeightsError, match='tensors do not fit its config.*size mismatch') as told:
        load_weights(saved)
    assert len(str(told.value).splitlines()) == 1


def test_a_tensor_that_is_lacking_is_named(saved, tiny):
    tensors = load_file(saved)
    del tensors['attention.location.bias']
    rewritten(saved, tiny, tensors)
    with pytest.raises(WeightsError, match=r'do not fit its config.*location\.bias'):
        load_weights(saved)


def test_half_precision_is_what_the_file_holds(saved):
    assert {tensor.dtype for tensor in load_file(saved).values()} == {torch.float16}
    assert np.isfinite([tensor.float().abs().max() for tensor in load_file(saved).values()]).all()


class Numbers(nn.Module):
    """Tensors that half precision would spoil, and a network's own."""

    def __init__(self):
        super().__init__()
        self.register_buffer('order', torch.arange(5000).flip(0))
        self.register_buffer('scale', torch.tensor([1e5]))
        self.register_buffer('endless', torch.tensor([torch.inf, 0.1]))


def test_whole_numbers_and_large_ones_are_stored_as_they_are(tmp_path, network, tiny):
    network.add_module('numbers', Numbers())
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network, None, tiny, 0.35))
    stored = load_file(path)
    for name, kept in (('order', torch.int64), ('scale', torch.float32),
                       ('endless', torch.float16)):
        own = getattr(network.numbers, name)
        assert stored[f'reconstruction.numbers.{name}'].dtype == kept
        assert_close(stored[f'reconstruction.numbers.{name}'].to(own), own, rtol=1e-3, atol=0)
