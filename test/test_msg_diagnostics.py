"""A node's state on `/diagnostics`: it comes back as it was, and others' states do no harm."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from msg_tools.diagnostics import diagnostics_from_msg, diagnostics_to_msg, NodeStatus
from msg_tools.stamps import stamp_from_nanoseconds
import pytest

STAMP = stamp_from_nanoseconds(1_500_000_000)
COUNTS = {'images': 3, 'refused/frame': 1}
FACTS = {'Episode': 'ab12', 'Images per second': '10.0', 'Views of the episode': '3', 'Done': ''}


@pytest.mark.parametrize('status', [
    NodeStatus('/node'),
    NodeStatus('/cell_2/reconstructor', COUNTS, FACTS, hardware_id='robot-7'),
    NodeStatus('/node', COUNTS, problem='refused: why'),
    NodeStatus('/node', {}, FACTS, failure='recording stopped'),
], ids=['nothing', 'everything', 'a problem', 'a failure'])
def test_a_state_comes_back_as_it_was(status):
    assert diagnostics_from_msg(diagnostics_to_msg(status, STAMP)) == {status.name: status}


@pytest.mark.parametrize(('problem', 'failure', 'level', 'message'), [
    ('', '', DiagnosticStatus.OK, 'ok'),
    ('a late pose', '', DiagnosticStatus.WARN, 'a late pose'),
    ('', 'the disk is full', DiagnosticStatus.ERROR, 'the disk is full'),
    ('a late pose', 'the disk is full', DiagnosticStatus.ERROR, 'the disk is full'),
])
def test_the_worst_makes_the_level_and_the_message(problem, failure, level, message):
    msg = diagnostics_to_msg(NodeStatus('/node', problem=problem, failure=failure), STAMP)
    assert msg.header.stamp == STAMP
    assert (msg.status[0].level, msg.status[0].message) == (level, message)


def test_the_values_of_others_are_facts_unless_they_count_something():
    values = {'': 'no key', 'temperature': '41.5', 'cpu': '-3', 'cores': '16', 'load': '٣'}
    msg = DiagnosticArray(status=[DiagnosticStatus(
        name='cpu_monitor: usage', level=DiagnosticStatus.STALE, message='no answer',
        values=[KeyValue(key=key, value=value) for key, value in values.items()])])
    status = diagnostics_from_msg(msg)['cpu_monitor: usage']
    assert status.counts == {'cores': 16}
    assert status.facts == {key: values[key] for key in values if key != 'cores'}
    assert status.failure == 'no answer'
