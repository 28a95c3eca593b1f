"""Which views come when, and that views are shown once each, whatever is asked after them."""

from active_recon.evaluation.posed.walking import (
    even_orders,
    on_turntable,
    random_orders,
    some_objects,
    walk,
)
from active_recon.evaluation.rollouts import Observer
from active_recon.geometry.cameras import orbit_camera, TURN
import numpy as np
import pytest
import torch

SCATTERED = np.stack([orbit_camera(azimuth, elevation, 2.0).direction for azimuth, elevation in
                      np.random.default_rng(0).uniform(0, 1.4, (9, 2)) * [4, 1]])


def ring(count):
    return np.stack([orbit_camera(step * TURN / count, 0.5, 2.0).direction
                     for step in range(count)])


def test_random_orders_hold_every_view_once_and_differ():
    orders = random_orders(20, 12)
    np.testing.assert_array_equal(np.sort(orders), np.tile(np.arange(12), (20, 1)))
    assert len({tuple(order) for order in orders.tolist()}) == 20
    np.testing.assert_array_equal(orders[:5], random_orders(5, 12))
    assert (orders != random_orders(20, 12, seed=1)).any()


@pytest.mark.parametrize(('count', 'expected'), [
    (2, [5, 17]), (3, [5, 13, 21]), (5, [5, 10, 15, 19, 0]), (1, [5])])
def test_views_of_a_turntable_are_as_many_steps_apart(count, expected):
    order = even_orders(ring(24)[None], count, np.array([5]))
    np.testing.assert_array_equal(order, [expected])


def test_a_turntable_may_turn_clockwise():
    order = even_orders(ring(24)[None, ::-1], 5, np.array([18]))
    np.testing.assert_array_equal(order, [[18, 23, 4, 8, 13]])


def test_the_even_views_of_an_object_are_the_same_whatever_is_measured_beside_it():
    scattered = np.random.default_rng(0).normal(size=(24, 3))
    scattered /= np.linalg.norm(scattered, axis=1, keepdims=True)
    shown = np.stack([ring(24), scattered, ring(24)[::-1]])
    first = np.array([3, 5, 18])
    for row, order in enumerate(even_orders(shown, 5, first)):
        np.testing.assert_array_equal(
            order, even_orders(shown[row:row + 1], 5, first[row:row + 1])[0])


def test_views_from_anywhere_are_each_the_farthest_from_those_before():
    first = np.array([2, 7])
    order = even_orders(np.stack([SCATTERED] * 2), 6, first)
    np.testing.assert_array_equal(order[:, 0], first)
    for row in order:
        assert len(set(row)) == 6
        for step in range(1, 6):
            away = (SCATTERED @ SCATTERED[row[:step]].T).max(axis=1)
            rest = [view for view in range(9) if view not in row[:step]]
            assert away[row[step]] == pytest.approx(min(away[rest]))


def test_as_many_even_views_as_there_are_are_all_of_them():
    for directions in (ring(24), SCATTERED):
        order = even_orders(directions[None], len(directions), np.array([3]))
        np.testing.assert_array_equal(np.sort(order[0]), np.arange(len(directions)))


def test_a_turntable_is_known_by_its_cameras(views):
    assert on_turntable(views)
    raised = some_objects(views, torch.arange(2))
    raised.poses[0, 3, 2, 3] += 0.6
    assert not on_turntable(raised)


class Counting(Observer):
    """Counts how often a view is taken in."""

    taken = 0

    def update(self, objects, chosen, state, yaws=None):
        self.taken += 1
        return super().update(objects, chosen, state, yaws)


@torch.inference_mode()
def test_an_order_that_goes_on_begins_where_the_one_before_ended(network, views):
    observer, objects = Counting(network, views), torch.arange(3)
    order = random_orders(3, 24)[:, :5]
    orders = [order[:, :1], order[:, :3], order, order[:, ::-1], order[:, 1:2]]
    steps = list(walk(observer, objects, orders))
    assert observer.taken == 5 + 5 + 1
    for own, shown in zip(steps, orders, strict=True):
        alone = next(walk(Observer(network, views), objects, [shown]))
        torch.testing.assert_close(own, alone)


def test_some_objects_are_a_set_of_their_own(views):
    some = some_objects(views, torch.tensor([4, 1]))
    assert len(some) == 2 and some.folders == (views.folders[4], views.folders[1])
    torch.testing.assert_close(some.images[0], views.images[4])
    torch.testing.assert_close(some.voxels[1], views.voxels[1])
