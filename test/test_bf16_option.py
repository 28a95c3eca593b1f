"""Mixed precision by default is for what computes with it: elsewhere it takes far longer."""

from active_recon.cli import bf16_option
from active_recon.cli.bf16_option import in_bf16
import pytest


@pytest.mark.parametrize('has', [True, False])
def test_mixed_precision_is_what_was_asked_for_else_what_the_device_has(monkeypatch, has):
    monkeypatch.setattr(bf16_option, 'has_bf16', lambda: has)
    assert in_bf16(None) is has
    assert in_bf16(None, 'cuda') is True
    assert (in_bf16(True), in_bf16(False, 'cuda')) == (True, False)
