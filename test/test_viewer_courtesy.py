"""The page gives way to an image that is on its way, and to nothing else."""

from active_recon.viewer.courtesy import Courtesy, GIVE_WAY_S
import pytest


def test_the_page_waits_from_an_image_to_its_answer():
    courtesy = Courtesy()
    for begin in (1.0, 2.0):
        courtesy.image(begin)
        assert not courtesy.has_turn(begin)
        assert not courtesy.has_turn(begin + 0.9 * GIVE_WAY_S)
        courtesy.answer()
        assert courtesy.has_turn(begin + 0.9 * GIVE_WAY_S)


def test_an_image_that_nothing_comes_of_is_not_waited_for_long():
    courtesy = Courtesy()
    courtesy.image(1.0)
    assert courtesy.has_turn(1.0 + 1.1 * GIVE_WAY_S)


def test_where_no_image_came_nothing_is_waited_for():
    courtesy = Courtesy()
    assert courtesy.has_turn(0.0)
    courtesy.answer()
    assert courtesy.has_turn(1.0)


@pytest.mark.parametrize('images_per_s', [10, 30, 60, 1000])
def test_a_camera_that_streams_leaves_the_page_its_thirty_turns_a_second(images_per_s):
    courtesy = Courtesy()
    turns = 0
    for millisecond in range(960):
        now = millisecond / 960
        if millisecond * images_per_s // 960 != (millisecond - 1) * images_per_s // 960:
            courtesy.image(now)
        if millisecond % 16 == 0:  # it asks sixty times a second
            turns += courtesy.has_turn(now)
    assert turns >= 30
