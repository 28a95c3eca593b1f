"""The recorder asks any node for its parameters, also one that cannot tell them all."""

from contextlib import suppress

from mcap.exceptions import McapError
from mcap.reader import make_reader
import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import Header
import yaml

pytestmark = pytest.mark.ros


def attached(path):
    """Return the parameters of each node, as an open or a finished file has them."""
    with path.open('rb') as stream, suppress(McapError):  # read while it is written
        return {attachment.name: yaml.safe_load(attachment.data)
                for attachment in make_reader(stream).iter_attachments()}
    return {}


def test_a_parameter_without_a_value_hides_no_other(bench, start_node, tmp_path):
    bench.node.declare_parameter('unset', Parameter.Type.DOUBLE)
    bench.node.declare_parameter('gains', [0.5, float('inf')])
    bench.node.create_publisher(Header, 'episode', 10)
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', topics="['episode']")
    (path,) = (tmp_path / 'bags').glob('*/*.mcap')
    told = bench.until(lambda: attached(path).get('parameters/bench.yaml'), "the bench's own")
    assert told['gains'] == [0.5, float('inf')]
    assert 'unset' not in told
    assert recorder.running
