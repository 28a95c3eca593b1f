"""Which signals ask a process to stop, and when they are heard."""

import os
import signal

from active_recon.interrupts import held_interrupts, stop_signals
import pytest


@pytest.fixture
def hangup():
    """Give the signal of a closed terminal what it had before."""
    before = signal.getsignal(signal.SIGHUP)
    yield signal.SIGHUP
    signal.signal(signal.SIGHUP, before)


def test_a_closed_terminal_is_heard_where_it_is_asked_for(hangup):
    signal.signal(hangup, signal.SIG_DFL)
    with pytest.raises(KeyboardInterrupt), held_interrupts() as raise_if_asked:
        os.kill(os.getpid(), hangup)
        raise_if_asked()
    assert signal.getsignal(hangup) == signal.SIG_DFL


def test_what_nohup_started_outlives_its_terminal(hangup):
    signal.signal(hangup, signal.SIG_IGN)
    assert set(stop_signals()) == {signal.SIGINT, signal.SIGTERM}
    with held_interrupts() as raise_if_asked:
        os.kill(os.getpid(), hangup)
        raise_if_asked()
