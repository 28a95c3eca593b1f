"""The entropy between ROS and the core."""

import math

from active_recon.errors import MessageError
from msg_tools.entropy import entropy_from_msg, entropy_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Header


@pytest.mark.parametrize('entropy', [0.0, 1 / 3, 181_704.25])
def test_an_entropy_comes_back_to_the_bit_under_its_stamp_and_name(entropy):
    header = Header(stamp=stamp_from_nanoseconds(1_795_000_000_123_456_789), frame_id='object')
    msg = entropy_to_msg(entropy, header)
    assert entropy_from_msg(msg) == entropy
    assert (msg.header, msg.name) == (header, ['entropy'])
    assert [list(numbers) for numbers in (msg.velocity, msg.effort)] == [[0.0], [0.0]]


@pytest.mark.parametrize('positions', [[], [1.0, 2.0], [math.nan], [math.inf]])
def test_what_is_no_single_finite_number_is_refused(positions):
    with pytest.raises(MessageError, match='invalid entropy|entropy not finite') as caught:
        entropy_from_msg(JointState(position=positions))
    assert caught.value.kind == 'entropy'
