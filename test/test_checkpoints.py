"""Checkpoints: all or nothing on disk, and no other model's."""

import os
from pathlib import Path
import pickletools

from active_recon.errors import DataError
from active_recon.models.attention import AttentionModel
from active_recon.models.network_2d3d import Network2d3d
from active_recon.training.checkpoints import Checkpoint, load_checkpoint, save_checkpoint
import pytest
from safetensors.torch import load_file
import torch
from torch.testing import assert_close

POINT = Checkpoint(7, {'training': {'steps': 9, 'bfloat16': True}}, [{'step': 7, 'loss': 0.5}])


def optimizer_of(module):
    return torch.optim.AdamW(module.parameters(), 1e-2, betas=(0.9, 0.99))


def step(module, optimizer, seed):
    """Take a step of training on a random answer."""
    torch.manual_seed(seed)
    optimizer.zero_grad()
    proposal, _ = module(torch.randn(4, 8, 4, 4), torch.rand(4), module.initial_state(4))
    (proposal.mean_azimuth.square().mean() + proposal.baseline.square().mean()).backward()
    optimizer.step()


@pytest.fixture
def trained(attention):
    optimizer = optimizer_of(attention)
    for seed in range(3):
        step(attention, optimizer, seed)
    return attention, optimizer


@pytest.fixture
def saved(trained, tmp_path):
    path = tmp_path / 'run' / 'policy.safetensors'
    save_checkpoint(path, *trained, POINT)
    return path


def test_a_restored_training_goes_on_as_the_saved_one_would(trained, saved, tiny):
    torch.manual_seed(5)
    other = AttentionModel.from_config(tiny)
    optimizer = optimizer_of(other)
    assert load_checkpoint(saved, other, optimizer) == POINT
    assert_close(other.state_dict(), trained[0].state_dict(), rtol=0, atol=0)
    for seed in range(3, 6):
        step(*trained, seed)
        step(other, optimizer, seed)
    assert_close(other.state_dict(), trained[0].state_dict(), rtol=0, atol=0)


def test_the_optimizers_memory_is_part_of_it(trained, saved, tiny):
    forgetful = AttentionModel.from_config(tiny)
    load_checkpoint(saved, forgetful, optimizer_of(forgetful))
    without_memory = optimizer_of(forgetful)
    step(*trained, 3)
    step(forgetful, without_memory, 3)
    assert (forgetful.where.weight - trained[0].where.weight).abs().max() > 1e-5


def test_a_part_never_replaces_a_whole(trained, saved, monkeypatch):
    whole = saved.read_bytes()

    def cut_off(path, data):
        with path.open('wb') as file:
            file.write(data[:100])
        raise OSError('No space left on device')

    monkeypatch.setattr(Path, 'write_bytes', cut_off)
    with pytest.raises(OSError, match='No space'):
        save_checkpoint(saved, *trained, Checkpoint(8, {}, []))
    assert saved.read_bytes() == whole
    assert load_checkpoint(saved, *trained).step == 7


def test_nothing_but_the_checkpoint_is_left_behind(saved):
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]


@pytest.mark.parametrize('share', [0.0, 0.3, 0.999])
def test_a_truncated_checkpoint_is_refused(trained, saved, share):
    raw = saved.read_bytes()
    saved.write_bytes(raw[:int(share * len(raw))])
    with pytest.raises(DataError, match='no whole checkpoint of this model'):
        load_checkpoint(saved, *trained)


def test_a_missing_checkpoint_and_another_models_are_refused(trained, saved, tiny):
    with pytest.raises(DataError, match='nothing.*no whole checkpoint'):
        load_checkpoint(saved.with_name('nothing'), *trained)
    other = Network2d3d.from_config(tiny)
    with pytest.raises(DataError, match='checkpoint of this model.*Missing key'):
        load_checkpoint(saved, other, optimizer_of(other))


def test_weights_without_a_checkpoints_word_are_refused(trained, saved):
    from safetensors.torch import save_file
    save_file(load_file(saved), saved)
    with pytest.raises(DataError, match='no whole checkpoint'):
        load_checkpoint(saved, *trained)


def test_nothing_in_it_is_a_pickle(saved):
    raw = saved.read_bytes()
    with pytest.raises(ValueError, match='.'):
        list(pickletools.genops(raw))
    assert int.from_bytes(raw[:8], 'little') < len(raw)


def test_a_checkpoint_may_be_read_by_whom_the_user_lets_read_files(trained, tmp_path):
    before = os.umask(0o027)
    try:
        save_checkpoint(tmp_path / 'run.safetensors', *trained, POINT)
    finally:
        os.umask(before)
    assert (tmp_path / 'run.safetensors').stat().st_mode & 0o777 == 0o640


def test_weights_that_are_tied_are_saved_and_restored(tmp_path):
    torch.manual_seed(0)
    modules = [torch.nn.Sequential(torch.nn.Linear(3, 3), torch.nn.Linear(3, 3)) for _ in 'ab']
    for module in modules:
        module[1].weight = module[0].weight
    path = tmp_path / 'tied.safetensors'
    save_checkpoint(path, modules[0], optimizer_of(modules[0]), POINT)
    load_checkpoint(path, modules[1], optimizer_of(modules[1]))
    assert_close(modules[1].state_dict(), modules[0].state_dict(), rtol=0, atol=0)
