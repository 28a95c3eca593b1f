"""What the soak reads of memory: growth is found, a warm-up is no growth, and a block counts."""

import mmap
import os

from benchmarks import memory
from benchmarks.memory import Memory, peak_mb, resident_mb
import numpy as np
import pytest


def use_of(monkeypatch, samples):
    remaining = iter(samples)
    monkeypatch.setattr(memory, 'resident_mb', lambda _pid: next(remaining))
    watched = Memory({'node': 1})
    for _ in samples:
        watched.sample()
    return watched.use()['node']


def test_a_warm_up_is_no_growth(monkeypatch):
    use = use_of(monkeypatch, [50.0, 90.0, *[100.0] * 98])
    assert (use.warm_mb, use.end_mb, use.growth_mb, use.peak_mb) == (100, 100, 0, 100)


@pytest.mark.parametrize('samples', [[], [100.0]])
def test_of_fewer_than_two_samples_no_growth_is_told(monkeypatch, samples):
    assert np.isnan(use_of(monkeypatch, samples).growth_mb)


def test_steady_growth_is_found_and_a_spike_is_not(monkeypatch):
    growing = 100 + np.arange(100) * 0.1
    assert use_of(monkeypatch, growing).growth_mb == pytest.approx(8, abs=0.1)
    spiky = [100.0] * 100
    spiky[97] = 400.0
    use = use_of(monkeypatch, spiky)
    assert (use.growth_mb, use.peak_mb) == (0, 400)


def test_a_block_of_memory_is_seen_in_the_process_that_holds_it():
    before = resident_mb(os.getpid())
    with mmap.mmap(-1, 64_000_000) as block:  # not of the heap, which may keep what was freed
        for page in range(0, len(block), mmap.PAGESIZE):
            block[page] = 1
        assert resident_mb(os.getpid()) - before == pytest.approx(64, abs=10)
    assert peak_mb(os.getpid()) >= before
