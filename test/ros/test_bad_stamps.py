"""What the reconstructor says of stamps that cannot be right, over real DDS."""

import re

from active_recon.geometry.cameras import orbit_camera
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import camera_to_msgs
import pytest
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, BUDGET_S, FakeCamera, SEND_AGAIN_S

pytestmark = pytest.mark.ros


def test_a_goal_without_a_stamp_is_refused(start_node, bench):
    node = start_node('reconstructor', weights=ANY_WEIGHTS)
    goals = bench.advertise(PoseStamped, 'next_view')
    _, pose = camera_to_msgs(orbit_camera(0.5), Header())
    said = 'refused: goal without a stamp: expected that of when it was published, got 0'
    sent = 0
    while not node.log(said):
        assert sent < BUDGET_S / SEND_AGAIN_S
        goals.publish(pose)  # the listener that was found may be of a node that has just ended
        sent += 1
        bench.within(SEND_AGAIN_S, lambda: node.log(said))
    # A busy machine hears the first only after the second was sent
    assert 1 <= bench.counts('reconstructor').get('refused/no_stamp', 1) <= sent
    assert 'goals_unused' not in bench.counts('reconstructor')


def test_images_from_a_clock_that_is_far_ahead_are_warned_of(start_node, bench):
    reconstructor = start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all')
    camera = FakeCamera(bench)
    camera.show()
    assert 'warned/clock_ahead' not in bench.counts('reconstructor')
    camera.send(*camera.messages(bench.now() + 1_000_000_000_000))
    bench.until(lambda: bench.counts('reconstructor').get('warned/clock_ahead'), 'the warning')
    line, = reconstructor.log('stamped')
    assert re.search('an image is stamped (999|1000) s from now: expected stamps of this', line)
