"""How a process of nodes is asked to stop: the wait of its executor ends, and nothing is left."""

import os
import signal
import threading

from active_recon.interrupts import stop_signals
from active_recon.nodes.runtime.run import StopRequests
import pytest
from rclpy.executors import SingleThreadedExecutor

from .conftest import BUDGET_S

pytestmark = pytest.mark.ros


@pytest.fixture
def stop():
    before = {number: signal.getsignal(number) for number in stop_signals()}
    yield StopRequests()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('asked', [signal.SIGINT, signal.SIGTERM])
def test_a_request_ends_the_wait_and_afterwards_nobody_waits_for_one(ros, stop, asked):
    executor = SingleThreadedExecutor()
    before = threading.active_count()
    with stop.waking(executor):
        assert not stop.requested
        asking = threading.Timer(0.1, os.kill, (os.getpid(), asked))
        asking.start()
        executor.spin_once(BUDGET_S)
        assert stop.requested
    asking.join()
    assert threading.active_count() == before
    assert signal.set_wakeup_fd(-1) == -1
    executor.shutdown()
