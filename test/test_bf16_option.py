"""Mixed precision by default is for what computes with it: elsewhere it takes far longer."""

from active_recon.cli import bf16_option
from active_recon.cli.bf16_option import in_bf16, trained_in_bf16
from active_recon.training import loop
import pytest
import torch


@pytest.fixture(params=[True, False])
def processor(request, monkeypatch):
    """Return whether the processor has bfloat16."""
    for module in (bf16_option, loop):
        monkeypatch.setattr(module, 'has_bf16', lambda: request.param)
    return request.param


def test_mixed_precision_is_what_was_asked_for_else_what_the_processor_has(processor):
    assert [in_bf16(asked) for asked in (None, True, False)] == [processor, True, False]


@pytest.mark.parametrize('gpu', [None, True, False])
def test_a_training_asks_the_gpu_where_there_is_one(processor, monkeypatch, gpu):
    monkeypatch.setattr(torch.cuda, 'is_available', lambda: gpu is not None)
    monkeypatch.setattr(torch.cuda, 'is_bf16_supported', lambda including_emulation: gpu)
    default = processor if gpu is None else gpu
    assert [trained_in_bf16(asked) for asked in (None, True, False)] == [default, True, False]
