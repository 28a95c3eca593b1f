"""A surface as a Marker: the same triangles and colours on both sides."""

from active_recon.errors import MessageError
from msg_tools.markers import no_surface_to_msg, surface_from_msg, surface_to_msg
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header
import trimesh
from visualization_msgs.msg import Marker

BALL = trimesh.creation.icosphere(1, 0.1)
COLORS = np.random.default_rng(0).integers(0, 256, (len(BALL.vertices), 3), np.uint8)
HEADER = Header(frame_id='object')


def sent(msg):
    return deserialize_message(serialize_message(msg), Marker)


@pytest.mark.parametrize('colors', [COLORS, None], ids=['coloured', 'grey'])
def test_a_surface_comes_back_as_it_was(colors):
    msg = sent(surface_to_msg(BALL.vertices, BALL.faces, colors, HEADER))
    triangles, back = surface_from_msg(msg)
    np.testing.assert_array_equal(triangles, BALL.vertices[BALL.faces])
    if colors is None:
        assert back is None
    else:
        np.testing.assert_array_equal(back, colors[BALL.faces])
    assert msg.header.frame_id == 'object'
    assert (msg.action, msg.pose.orientation.w, msg.scale.x) == (Marker.ADD, 1, 1)


def test_what_removes_a_surface_names_the_same_marker():
    shown = surface_to_msg(BALL.vertices, BALL.faces, None, HEADER)
    gone = sent(no_surface_to_msg(HEADER))
    assert gone.action == Marker.DELETE
    assert (gone.ns, gone.id) == (shown.ns, shown.id)


@pytest.mark.parametrize(('spoil', 'said'), [
    (lambda msg: setattr(msg, 'type', Marker.CUBE), 'of the type TRIANGLE_LIST'),
    (lambda msg: msg.points.pop(), 'three points a triangle'),
    (lambda msg: msg.colors.pop(), 'wrong number of colours: expected 240 or none, got 239'),
    (lambda msg: setattr(msg.colors[0], 'r', 1.5), 'invalid colours')])
def test_what_is_no_surface_is_refused(spoil, said):
    msg = sent(surface_to_msg(BALL.vertices, BALL.faces, COLORS, HEADER))
    spoil(msg)
    with pytest.raises(MessageError, match=said) as caught:
        surface_from_msg(msg)
    assert caught.value.kind == 'mesh'
