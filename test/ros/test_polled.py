"""A polled subscription keeps what comes until its node takes it, and wakes nobody."""

from active_recon.nodes.runtime.polled import PolledCallbackGroup, take_messages
from active_recon.nodes.runtime.qos import LATCHED_POLLED_QOS, LATCHED_QOS
import pytest
from std_msgs.msg import Header

pytestmark = pytest.mark.ros


def test_messages_are_taken_once_in_their_order_and_no_callback_hears_them(bench):
    called = []
    polled = bench.node.create_subscription(
        Header, 'words', called.append, LATCHED_POLLED_QOS, callback_group=PolledCallbackGroup())
    publisher = bench.node.create_publisher(Header, 'words', LATCHED_QOS)
    woken = bench.subscribe(Header, 'words', LATCHED_POLLED_QOS)
    bench.until(lambda: publisher.get_subscription_count() == 2, 'both to be found')
    for word in 'abc':
        publisher.publish(Header(frame_id=word))
    bench.until(lambda: len(woken) == 3, 'the messages')
    assert not called
    assert [message.frame_id for message, _ in take_messages(polled)] == ['a', 'b', 'c']
    assert not list(take_messages(polled))
