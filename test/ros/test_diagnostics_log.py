"""How often what comes and goes is said in the log: real diagnostics of a node of the test's."""

from types import SimpleNamespace

from active_recon.nodes.runtime import diagnostics as diagnostics_module
from active_recon.nodes.runtime.diagnostics import (
    Diagnostics,
    FORGOTTEN_S,
    LOG_EVERY_S,
    PROBLEM_FOR_S,
)
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
import pytest
from rclpy.node import Node

pytestmark = pytest.mark.ros


@pytest.fixture
def clock(monkeypatch):
    """Return the diagnostics' time, in the test's hand."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(
        diagnostics_module, 'time', SimpleNamespace(monotonic=lambda: clock.now))
    return clock


@pytest.fixture
def said(monkeypatch, bench):
    """Return the lines of the log."""
    lines = []
    monkeypatch.setattr(bench.node, 'get_logger', lambda: SimpleNamespace(
        info=lambda line: lines.append(f'INFO {line}'),
        warning=lambda line: lines.append(f'WARN {line}')))
    return lines


def test_a_trouble_that_comes_and_goes_is_said_with_its_end_once_in_a_while(bench, clock, said):
    diagnostics = Diagnostics(bench.node)
    for _ in range(50):
        diagnostics.raise_warning('silent', 'nothing comes')
        clock.now += 0.1
        diagnostics.clear_warning('silent')
        clock.now += 0.05
    assert said == ['WARN nothing comes', 'INFO over: nothing comes']
    clock.now += LOG_EVERY_S
    diagnostics.raise_warning('silent', 'nothing comes')
    diagnostics.clear_warning('silent')
    assert said[2:] == ['WARN nothing comes (and 49 more of this kind before)',
                        'INFO over: nothing comes']


def test_the_end_of_a_trouble_is_said_without_what_was_to_be_done(bench, clock, said):
    diagnostics = Diagnostics(bench.node)
    diagnostics.raise_warning('silent', 'nothing comes; is the camera on?')
    diagnostics.clear_warning('silent')
    assert said == ['WARN nothing comes; is the camera on?', 'INFO over: nothing comes']


def test_a_trouble_that_stays_is_said_although_one_of_its_kind_was_said_just_before(
        bench, clock, said):
    diagnostics = Diagnostics(bench.node)
    diagnostics.raise_warning('silent', 'nothing comes')
    diagnostics.clear_warning('silent')
    for _ in range(3):
        diagnostics.raise_warning('silent', 'still nothing')
        clock.now += 0.6 * LOG_EVERY_S
    assert said == ['WARN nothing comes', 'INFO over: nothing comes', 'WARN still nothing']
    diagnostics.clear_warning('silent')
    diagnostics.clear_warning('silent')
    assert said[3:] == ['INFO over: still nothing']


def test_a_problem_is_told_for_a_second_whatever_else_changes_meanwhile(bench, clock, said):
    heard = bench.subscribe(DiagnosticArray, '/diagnostics')
    diagnostics = Diagnostics(bench.node)
    bench.until(lambda: heard, 'the state at the start')
    diagnostics.warn('late', 'too late')
    for number in range(20):  # some of them right after the one of every second
        diagnostics.set_value('Number', str(number))
        bench.until(lambda number=number: KeyValue(key='Number', value=str(number)) in
                    heard[-1].status[0].values, 'the change')
        assert heard[-1].status[0].message == 'too late'
    clock.now += PROBLEM_FOR_S + 0.01
    bench.until(lambda: heard[-1].status[0].message == 'ok', 'an all-clear')


def test_a_node_says_that_another_has_its_name_until_that_is_gone(bench, clock, said):
    Diagnostics(bench.node)
    other = Node('bench', context=bench.node.context)
    asked = bench.now()
    bench.until(lambda: bench.now() > asked + 1.5e9, 'some checks')
    assert not said  # it may have been killed a moment ago
    clock.now += FORGOTTEN_S + 1
    bench.until(lambda: said, 'the warning')
    other.destroy_node()
    bench.until(lambda: len(said) > 1, 'its end')
    named = '/bench: another node has the same name: expected one, since both answer what is meant'
    assert said[0].startswith(f'WARN {named}') and said[1].startswith(f'INFO over: {named}')
