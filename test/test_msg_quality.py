"""The quality between ROS and the core."""

from active_recon.errors import MessageError
from active_recon.quality.quality import Quality, SUSPECTS
from diagnostic_msgs.msg import DiagnosticStatus
from judged_quality import quality_of
from msg_tools.quality import judged_size, quality_from_msg, quality_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import pytest
from std_msgs.msg import Header

HEADER = Header(stamp=stamp_from_nanoseconds(1_795_000_000_123_456_789), frame_id='object')


@pytest.mark.parametrize('suspect', ['', *SUSPECTS])
def test_a_quality_comes_back_to_the_bit_under_its_stamp(suspect):
    quality = Quality(1 / 3, 0.1, 0.0, 1.0, 1e-3, 2 / 3, suspect, 0.3)
    msg = quality_to_msg(quality, HEADER)
    assert quality_from_msg(msg) == quality
    assert msg.header == HEADER


def test_a_suspect_is_a_warning_with_its_question():
    usual, unusual = (quality_to_msg(quality_of(suspect=suspect), HEADER).status[0]
                      for suspect in ('', 'pose'))
    assert (usual.level, usual.message) == (DiagnosticStatus.OK, 'ok')
    assert unusual.level == DiagnosticStatus.WARN
    assert SUSPECTS['pose'] in unusual.message


@pytest.mark.parametrize(('name', 'value'), [
    ('expected_iou', '1.5'), ('p_value', 'nan'), ('lower_bound', 'much'), ('suspect', 'luck')])
def test_values_that_are_no_quality_are_refused(name, value):
    msg = quality_to_msg(quality_of(), HEADER)
    for pair in msg.status[0].values:
        if pair.key == name:
            pair.value = value
    with pytest.raises(MessageError) as caught:
        quality_from_msg(msg)
    assert caught.value.kind == 'quality'


def test_a_quality_from_before_there_were_promises_of_the_learned_policy_has_none():
    msg = quality_to_msg(quality_of(promise=0.5, promise_learned=0.6), HEADER)
    msg.status[0].values = [pair for pair in msg.status[0].values
                            if pair.key != 'promise_learned']
    assert quality_from_msg(msg) == quality_of(promise=0.5)


def test_the_side_of_the_judged_cube_comes_back_to_the_bit_where_it_is_told():
    told, untold = (quality_to_msg(quality_of(), HEADER, object_size=size)
                    for size in (1 / 3, None))
    assert judged_size(told) == 1 / 3 and judged_size(untold) is None
    assert quality_from_msg(told) == quality_from_msg(untold) == quality_of()
    next(pair for pair in told.status[0].values if pair.key == 'object_size').value = 'wide'
    assert judged_size(told) is None


def test_a_quality_that_lacks_a_value_is_refused():
    msg = quality_to_msg(quality_of(), HEADER)
    msg.status[0].values = msg.status[0].values[1:]
    with pytest.raises(MessageError, match='expected expected_iou too'):
        quality_from_msg(msg)
