"""What is told of a camera's streams as a whole."""

import math

from active_recon.acquisition.stream_monitor import StreamMonitor, STREAMS, WINDOW_S
import numpy as np
import pytest

MS = 1_000_000
RATES = [5.0, 10.0, 30.0, 100.0]
HIGH_RATE = pytest.param(RATES[-1], marks=pytest.mark.slow)


class Streams:
    """A camera at a rate, heard by a monitor, its faults in the test's hand."""

    def __init__(self, rate=30.0):
        self.monitor = StreamMonitor()
        self.period = 1 / rate
        self.now = 100.0

    def run(self, seconds, lost=lambda stream, number: False, late_s=0.0, pose_shift=0):
        """Go on for a while; return the first time from now at which each fault was found."""
        began, found, waiting = self.now, {}, []
        for number in range(round(seconds / self.period)):
            stamp = round(self.now * 1e9)
            for stream in ('poses', 'camera_info', 'images'):
                if not lost(stream, number):
                    due = self.now + (late_s if stream == 'images' else 0)
                    waiting.append((due, stream, stamp + pose_shift * (stream == 'poses')))
            for entry in [entry for entry in waiting if entry[0] <= self.now]:
                waiting.remove(entry)
                self.monitor.add(entry[1], entry[2], self.now)
            self.look(self.period, began, found)
        return found

    def look(self, seconds, began=0.0, found=None):
        """Look what is wrong, ten times a second at least; return what is in the end."""
        looks = math.ceil(seconds / 0.1)
        for _ in range(looks):
            for kind in self.monitor.faults(self.now):
                if found is not None:
                    found.setdefault(kind, self.now - began)
            self.now += seconds / looks
        return self.monitor.faults(self.now)


@pytest.mark.parametrize('rate', [1.0, *RATES])
def test_nothing_is_found_wrong_with_a_steady_camera(rate):
    assert not Streams(rate).run(60 / rate + 3)


@pytest.mark.parametrize('rate', [*RATES[:-1], HIGH_RATE])
@pytest.mark.parametrize('stream', STREAMS)
def test_a_stream_that_ends_is_told_within_a_second_by_its_name_and_no_more_when_it_is_back(
        rate, stream):
    streams = Streams(rate)
    streams.run(25 / rate + 2)
    found = streams.run(2.0, lambda which, _: which == stream)
    assert found.keys() == {f'silent_{stream}'}
    assert 0.3 < found[f'silent_{stream}'] <= 1.0
    streams.run(2 * WINDOW_S)
    assert not streams.monitor.faults(streams.now)


def test_a_camera_that_is_gone_is_one_fault_and_not_three():
    streams = Streams()
    streams.run(3.0)
    assert streams.run(2.0, lambda *_: True).keys() == {'silent_camera'}


def test_a_slow_stream_is_silent_after_three_of_its_periods_only():
    streams = Streams(rate=1.0)
    streams.run(25.0)
    assert not streams.look(1.5)
    assert streams.look(2.0).keys() == {'silent_camera'}


def test_a_watch_that_is_held_up_takes_no_camera_for_silent():
    streams = Streams()
    streams.run(3.0)
    streams.now += 5.0
    assert not streams.monitor.faults(streams.now)
    assert streams.look(1.0).keys() == {'silent_camera'}


@pytest.mark.parametrize('arrivals', [
    np.cumsum(np.random.default_rng(0).choice([0.0005, 1.0], 40)),
    np.cumsum(np.tile([0.0004, 0.0006, 0.0003, 0.0005, 1.0], 8)),
    [0.0, 0.1, 0.2, 0.3], []], ids=['now and then', 'in bursts', 'a few', 'none'])
def test_what_does_not_come_regularly_is_not_missed(arrivals):
    monitor = StreamMonitor()
    for now in arrivals:
        for stream in STREAMS:
            monitor.add(stream, round(now * 1e9), now)
        assert not monitor.faults(now)
    for later in range(50):
        assert not monitor.faults(100.0 + later / 10)


@pytest.mark.parametrize('rate', [10.0, 30.0, HIGH_RATE])
@pytest.mark.parametrize('stream', ['images', 'poses'])
def test_a_third_that_is_missing_is_told_within_a_second_or_so_and_no_more_when_it_comes_again(
        rate, stream):
    streams = Streams(rate)
    streams.run(25 / rate + 2)
    found = streams.run(3.0, lambda which, number: which == stream and number % 3 == 2)
    assert found.keys() == {f'missing_{stream}'}
    assert found[f'missing_{stream}'] <= 1.2
    streams.run(2 * WINDOW_S)
    assert not streams.monitor.faults(streams.now)


@pytest.mark.parametrize(('numbered', 'busy_s', 'said'), [
    (False, 0.0, 'lost in transport, or never published'),
    (True, 0.0, 'lost in transport: they were published'),
    (True, 0.9, 'lost in processing: this node was busy for 0.9 s')])
def test_missing_images_are_told_with_where_they_were_lost(numbered, busy_s, said):
    streams = Streams()
    streams.run(3.0)
    streams.now += busy_s
    found = ''
    for _ in range(10):
        streams.run(0.2, lambda which, number: which == 'images' and number % 3 == 1)
        if numbered:
            streams.monitor.add_lost(streams.now)
        found = streams.monitor.faults(streams.now).get('missing_images', found)
    assert said in found


def test_a_message_lost_now_and_then_is_not_told():
    streams = Streams()
    assert not streams.run(20.0, lambda which, number: which == 'images' and number % 40 == 39)


def test_a_tracker_whose_poses_have_stamps_of_their_own_misses_none():
    streams = Streams()
    assert not streams.run(5.0, pose_shift=5 * MS)
    assert streams.run(3.0, lambda which, number: which == 'images' and number % 3 == 2,
                       pose_shift=5 * MS).keys() == {'missing_images'}


@pytest.mark.parametrize('late_s', [0.2, 0.4, 1.0])
def test_images_that_come_late_are_told_within_a_second_or_so_of_the_first(late_s):
    streams = Streams()
    streams.run(3.0)
    found = streams.run(5.0, late_s=late_s)
    assert found['late_images'] <= late_s + 0.5
    assert streams.monitor.faults(streams.now).keys() == {'late_images'}


def test_images_a_little_behind_their_poses_are_not_late():
    assert not Streams().run(5.0, late_s=0.07)


def test_after_the_clock_went_back_a_stream_is_watched_anew():
    monitor = StreamMonitor()
    for index in range(40):
        for stream in STREAMS:
            monitor.add(stream, (1000 if index < 10 else 0) * 10**9 + index * 33 * MS, index / 30)
        assert not monitor.faults(index / 30)
    found = [monitor.faults(40 / 30 + later / 10) for later in range(10)]
    assert found[-1].keys() == {'silent_camera'}


def test_after_clear_nothing_is_missed_before_it_has_come_anew():
    streams = Streams()
    streams.run(3.0)
    streams.monitor.clear()
    assert not streams.look(10.0)


def test_memory_is_bounded_by_the_window():
    streams = Streams()
    streams.run(4.0)
    size = len(streams.monitor._moments)
    streams.run(12.0)
    assert len(streams.monitor._moments) <= size
