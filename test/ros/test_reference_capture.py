"""The image of the empty scene is the first that was taken after it was asked for."""

from active_recon.errors import MessageError
from active_recon.nodes.camera.reference_capture import ReferenceCapture
import numpy as np
import pytest
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros
OLD, NEW = (np.full((4, 5, 3), grey, np.uint8) for grey in (1, 2))
S = 10**9


@pytest.fixture
def capture(bench):
    return ReferenceCapture(bench.node, 'reference')


@pytest.fixture
def asked(bench, capture):
    """Return the answer to come of a call that the service has received."""
    client = bench.node.create_client(Trigger, 'capture_background')
    bench.until(client.service_is_ready, 'the service')
    answer = client.call_async(Trigger.Request())
    looked = []
    bench.until(lambda: capture.on_image(0, lambda: OLD) or looked.append(0) or len(looked) > 20,
                'some turns of the executor')
    return answer


def test_an_image_from_before_the_call_is_not_taken_and_one_from_after_it_is(
        bench, capture, asked):
    assert not asked.done() and capture.reference is None
    bench.until(lambda: capture.on_image(bench.now(), lambda: NEW) or asked.done(), 'the answer')
    assert asked.result().success
    assert asked.result().message == 'captured 5 x 4 pixels'
    assert capture.reference is NEW
    capture.on_image(bench.now(), lambda: OLD)
    assert capture.reference is NEW
    capture.clear()
    assert capture.reference is None


def test_bytes_that_are_no_image_are_passed_over(bench, capture, asked):
    def spoilt():
        raise MessageError('no image')

    def refused():
        try:
            capture.on_image(bench.now() + S, spoilt)
        except MessageError:
            return True
        return False

    bench.until(refused, 'the call to be known')
    bench.until(lambda: capture.on_image(bench.now(), lambda: NEW) or asked.done(), 'the answer')
    assert capture.reference is NEW


def test_a_call_without_an_image_is_answered_and_changes_nothing(bench, capture, asked):
    bench.until(asked.done, 'the answer')
    assert not asked.result().success
    assert 'none came within 2 s; is the camera running' in asked.result().message
    assert capture.reference is None


def test_an_image_that_no_background_is_compared_with_is_refused_at_once(bench):
    capture = ReferenceCapture(bench.node, 'as_is')
    answer = bench.call('capture_background')
    assert not answer.success
    assert 'expected the parameter background to be reference, got as_is' in answer.message
    assert capture.reference is None
