"""What a soak counts as missed."""

from dataclasses import replace
import json
import math

from benchmarks.memory import MemoryUse
from benchmarks.soak import as_markdown, DOCS, FLAGGED, Soak

USE = MemoryUse(warm_mb=100.0, end_mb=100.0, growth_mb=0.0, peak_mb=101.0)
SOAK = Soak('soak', 1.0, 2, 0.0, 20, 20, 100, 100, {}, '', 10.0, 20.0, {'reconstructor': USE}, 1.0)


def test_views_flagged_by_mistake_count_only_beyond_their_share():
    for flagged, missed in ((5, []), (6, ['6 views flagged as unusual'])):
        soak = replace(SOAK, faults={FLAGGED: flagged})
        assert soak.missed == missed
        assert '| refusals, warnings and losses | 0 | 0 |' in as_markdown(soak)


def test_any_other_fault_is_missed_by_its_name():
    soak = replace(SOAK, faults={'/reconstructor dropped/overtaken': 2})
    assert soak.missed == ['/reconstructor dropped/overtaken: 2']


def test_growth_that_is_not_known_is_missed():
    unknown = replace(USE, growth_mb=math.nan)
    assert replace(SOAK, memory={'reconstructor': unknown}).missed == [
        'memory was sampled too rarely to tell any growth']


def test_a_page_calls_a_latency_beyond_its_goal_missed():
    slow = replace(SOAK, latency_p50_ms=26.0, latency_p99_ms=61.0)
    assert 'Missed: p50 of the latency: 26.0 ms; p99 of the latency: 61.0 ms.' in as_markdown(slow)
    assert not slow.missed  # the exit code is not of how busy a machine is
    assert 'Missed: nothing.' in as_markdown(SOAK)


def test_the_documents_page_is_of_what_was_measured():
    found = json.loads((DOCS / 'soak.json').read_text())
    memory = {name: MemoryUse(**use) for name, use in found.pop('memory').items()}
    assert as_markdown(Soak(**found, memory=memory)) == (DOCS / 'soak.md').read_text()
