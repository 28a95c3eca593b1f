"""The reason for a goal between ROS and the core."""

from active_recon.errors import MessageError
from active_recon.policies.reasons import GoalReason
from msg_tools.reasons import goal_reason_from_msg, goal_reason_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import pytest
from std_msgs.msg import Header

HEADER = Header(stamp=stamp_from_nanoseconds(1_795_000_000_123_456_789), frame_id='object')


@pytest.mark.parametrize('gain', [None, 0.0, 1 / 3, -1e-9])
def test_a_reason_comes_back_to_the_bit_under_the_stamp_of_its_goal(gain):
    reason = GoalReason('shows the top: 40% of the doubt in sight was hidden', gain)
    msg = goal_reason_to_msg(reason, HEADER)
    assert goal_reason_from_msg(msg) == reason
    assert msg.header == HEADER


@pytest.mark.parametrize('gain', ['nan', 'inf', 'much'])
def test_a_gain_that_is_no_number_is_refused(gain):
    msg = goal_reason_to_msg(GoalReason('shows the top', 0.1), HEADER)
    msg.status[0].values[0].value = gain
    with pytest.raises(MessageError, match='expected a finite expected_gain') as caught:
        goal_reason_from_msg(msg)
    assert caught.value.kind == 'goal_reason'


def test_the_status_of_something_else_is_no_reason():
    msg = goal_reason_to_msg(GoalReason('shows the top'), HEADER)
    msg.status[0].name = 'battery'
    with pytest.raises(MessageError, match='expected a status of the name goal_reason, got batt'):
        goal_reason_from_msg(msg)
