"""Two planners of one camera: told while both publish goals, by the name of the other."""

import time

from active_recon.nodes.loop.other_planner import OtherPlanner
from active_recon.nodes.runtime.diagnostics import FORGOTTEN_S
from geometry_msgs.msg import PoseStamped
import pytest
from rclpy.node import Node

pytestmark = pytest.mark.ros


class Told:
    """Notes the warnings that hold."""

    def __init__(self):
        self.warnings = {}

    def raise_warning(self, kind, message):
        self.warnings[kind] = message

    def clear_warning(self, kind):
        self.warnings.pop(kind, None)


@pytest.fixture
def told():
    return Told()


def test_a_planner_tells_of_another_that_publishes_goals_until_that_is_gone(
        bench, told, monkeypatch):
    ahead, real = [0.0], time.monotonic
    monkeypatch.setattr(time, 'monotonic', lambda: real() + ahead[0])
    bench.node.create_publisher(PoseStamped, 'next_view', 1)
    watched = OtherPlanner(bench.node, told)
    other = Node('second_planner', context=bench.node.context)
    other.create_publisher(PoseStamped, 'next_view', 1)
    count = bench.node.count_publishers
    bench.until(lambda: count('next_view') == 2, 'the other to be heard of')
    watched.tell()
    assert not told.warnings  # it may have been killed a moment ago
    ahead[0] = FORGOTTEN_S + 1
    watched.tell()
    assert told.warnings['other_planner'].startswith(
        '/next_view: /second_planner publishes goals, too: expected one planner')
    watched.clear()
    assert not told.warnings
    watched.tell()
    assert told.warnings
    other.destroy_node()
    bench.until(lambda: count('next_view') == 1, 'the other to be gone')
    watched.tell()
    assert not told.warnings


def test_a_planner_that_was_started_again_under_its_name_is_no_other(bench, told, monkeypatch):
    bench.node.create_publisher(PoseStamped, 'next_view', 1)
    again = Node(bench.node.get_name(), context=bench.node.context)
    again.create_publisher(PoseStamped, 'next_view', 1)
    bench.until(lambda: bench.node.count_publishers('next_view') == 2, 'both')
    watched = OtherPlanner(bench.node, told)
    real = time.monotonic
    monkeypatch.setattr(time, 'monotonic', lambda: real() + 10 * FORGOTTEN_S)
    watched.tell()
    again.destroy_node()
    assert not told.warnings
