"""Batches that threads draw ahead: the same ones, in order, and not too many at once."""

import threading

from active_recon.training.ahead import drawn_ahead
import pytest


@pytest.mark.parametrize('threads', [0, 1, 3])
def test_every_step_comes_once_in_order_with_its_own_draw(threads):
    found = list(drawn_ahead(lambda step: step * step, range(5, 25), threads))
    assert found == [(step, step * step) for step in range(5, 25)]


def test_threads_draw_at_most_two_steps_each_ahead():
    drawn = []

    def draw(step):
        drawn.append(step)
        return step

    ahead = drawn_ahead(draw, range(100), 3)
    for asked in range(1, 5):
        next(ahead)
        assert len(drawn) <= asked + 2 * 3
    ahead.close()
    assert len(drawn) <= 4 + 2 * 3


def test_steps_are_drawn_while_the_step_before_is_computed():
    second = threading.Event()

    def draw(step):
        if step == 1:
            second.set()
        return step

    ahead = drawn_ahead(draw, range(2), 1)
    assert next(ahead) == (0, 0)
    assert second.wait(10)  # though it was not asked for yet
    assert list(ahead) == [(1, 1)]


@pytest.mark.parametrize('threads', [0, 2])
def test_an_error_of_a_draw_is_raised_at_its_step(threads):
    def draw(step):
        if step == 2:
            raise ValueError('no such view')
        return step

    came = []
    with pytest.raises(ValueError, match='no such view'):
        for step, _ in drawn_ahead(draw, range(5), threads):
            came.append(step)  # noqa: PERF402
    assert came == [0, 1]
