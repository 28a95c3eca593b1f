"""Where the time goes: stages add up, none is negative, and what is not known is not invented."""

from dataclasses import replace

from active_recon.report.page import report_page
from active_recon.report.stages import median, STAGES, timings, two_clocks
from active_recon.report.subject import Subject
import pytest
from report_runs import changed, DECISION, HAND_OVER, MS, NETWORK, recorded_run, TURN, WAY

IMAGE = 'camera/image_raw'


@pytest.fixture(scope='module')
def run():
    return recorded_run(policy='uniform', views=3)


def with_image_at(run, arrival):
    """Return the episode, its first image heard at another time; None is not at all."""
    first, *rest = run.episodes[0].views
    received = {name: at for name, at in (first.received | {IMAGE: arrival}).items()
                if at is not None}
    return changed(run, views=[replace(first, received=received), *rest]).episodes[0]


def test_stages_are_what_passed_and_add_up_to_the_way_from_image_to_goal(run):
    for timing, view in zip(timings(run.episodes[0]), run.episodes[0].views, strict=True):
        assert timing.turn == TURN / MS
        assert timing.stages[:3] == (WAY / MS, NETWORK / MS, HAND_OVER / MS)
        if view.goal is not None:
            assert timing.stages[3] == DECISION / MS
            assert sum(timing.stages) == timing.total == (view.goal.received - view.stamp) / MS


def test_last_view_of_an_episode_that_is_done_has_no_decision_and_no_total(run):
    last = timings(run.episodes[0])[-1]
    assert last.stages[3] is None
    assert last.total is None


def test_a_replay_has_messages_with_times_and_no_timing(run):
    replayed = replace(run, provenance={**run.provenance, 'replay_of': 'run'})
    assert Subject('A', run, run.episodes[0]).timed
    subject = Subject('A', replayed, replayed.episodes[0])
    for timing in timings(subject.episode, subject.timed):
        assert not any(known is not None for known in (*timing.stages, timing.total, timing.turn))
    page = report_page([subject])
    assert 'image to goal' in report_page([Subject('A', run, run.episodes[0])])
    assert 'image to goal' not in page


def test_what_overtakes_takes_no_time_and_the_sum_stays(run):
    stamp = run.episodes[0].views[0].stamp
    timing = timings(with_image_at(run, stamp + WAY + NETWORK + MS // 2))[0]
    assert timing.stages[1] == 0
    assert min(timing.stages) >= 0
    assert sum(timing.stages) == timing.total


def test_stages_on_both_sides_of_a_message_not_heard_are_unknown_but_the_total_is_known(run):
    whole, lacking = (timings(with_image_at(run, arrival))[0] for arrival in (
        run.episodes[0].views[0].received[IMAGE], None))
    assert lacking.stages[:2] == (None, None)
    assert lacking.stages[2:] == whole.stages[2:]
    assert lacking.total == whole.total


@pytest.mark.parametrize('off_s', [-3600, 3600])
def test_stamp_of_another_clock_says_nothing_of_the_way(run, off_s):
    first = run.episodes[0].views[0]
    strange = replace(first, stamp=first.stamp + off_s * 1_000_000_000)
    assert two_clocks(strange)
    assert not two_clocks(first)
    timing = timings(changed(run, views=[strange]).episodes[0])[0]
    assert (timing.stages[0], timing.total, timing.turn) == (None, None, None)
    assert timing.stages[1] == NETWORK / MS


def test_median_is_of_what_is_known():
    assert median([None, 3.0, 1.0, None, 2.0]) == 2.0
    assert median([None]) is None


def test_stages_have_names_of_their_own():
    assert len({stage.name for stage in STAGES}) == len(STAGES)
