"""The simulated turntable's motion, and what it shows."""

import math

from active_recon.errors import ConfigError, DataError, MeshError, ViewError
from active_recon.geometry.cameras import (
    azimuth_difference,
    CANONICAL_DISTANCE,
    CANONICAL_ELEVATION,
    orbit_camera,
)
from active_recon.simulation.orbit import Orbit
from active_recon.simulation.shown_object import object_anywhere, rendered_object
from active_recon.simulation.turntable import Turntable
import numpy as np
import pytest
import trimesh


def test_it_stands_where_it_starts_until_it_is_given_a_goal():
    turntable = Turntable(azimuth=-1.0)
    assert turntable.azimuth_at(100.0) == pytest.approx(math.tau - 1.0)


@pytest.mark.parametrize('goal', np.linspace(-7, 7, 29))
def test_it_turns_the_shortest_way_at_its_speed_and_stays(goal):
    turntable = Turntable(azimuth=1.0, speed=0.5, time_scale=2.0)  # 1 rad a second
    turntable.turn_to(goal, now=10.0)
    way = abs(azimuth_difference(goal, 1.0))
    times = np.linspace(10.0, 14.0, 401)
    azimuths = [turntable.azimuth_at(time) for time in times]
    moved = np.abs(azimuth_difference(azimuths, 1.0))
    np.testing.assert_allclose(moved, np.minimum(times - 10.0, way), atol=1e-9)
    assert azimuth_difference(azimuths[-1], goal) == pytest.approx(0, abs=1e-9)
    assert all(0 <= azimuth < math.tau for azimuth in azimuths)


def test_a_new_goal_is_left_for_from_where_the_camera_is():
    turntable = Turntable()
    turntable.turn_to(2.0, now=0.0)
    turntable.turn_to(0.0, now=1.5)
    assert turntable.azimuth_at(1.5) == pytest.approx(1.5)
    assert turntable.azimuth_at(2.5) == pytest.approx(0.5)


def test_the_same_goal_again_changes_nothing():
    once, twice = Turntable(), Turntable()
    once.turn_to(2.0, now=0.0)
    twice.turn_to(2.0, now=0.0)
    twice.turn_to(2.0, now=0.7)
    assert twice.azimuth_at(1.3) == pytest.approx(once.azimuth_at(1.3))


@pytest.mark.parametrize('goal', [math.nan, math.inf, -math.inf])
def test_a_goal_that_is_not_finite_is_refused_and_the_last_one_stays(goal):
    turntable = Turntable()
    turntable.turn_to(1.0, now=0.0)
    with pytest.raises(ViewError, match='not finite: expected radians, got -?(nan|inf)'):
        turntable.turn_to(goal, now=0.5)
    assert turntable.azimuth_at(2.0) == pytest.approx(1.0)


@pytest.mark.parametrize(('settings', 'said'), [
    ({'speed': 0.0}, 'speed or time scale out of range: expected both finite and above 0, got '
                     '0.0 and 1.0'),
    ({'time_scale': -1.0}, 'speed or time scale out of range: expected both finite and above 0, '
                           'got 1.0 and -1.0'),
    ({'azimuth': math.nan}, 'azimuth not finite: expected radians, got nan')])
def test_a_turntable_that_cannot_turn_is_refused(settings, said):
    with pytest.raises(ConfigError, match=f'turntable: {said}'):
        Turntable(**settings)


def test_another_speed_counts_from_where_the_camera_is():
    turntable = Turntable(azimuth=6.0, speed=1.0)
    turntable.turn_to(1.0, now=0.0)
    turntable.set_speed(0.1, 1.0, now=0.5)
    assert azimuth_difference(turntable.azimuth_at(0.5), 6.5) == pytest.approx(0)
    assert azimuth_difference(turntable.azimuth_at(1.5), 6.6) == pytest.approx(0)
    assert azimuth_difference(turntable.azimuth_at(100.0), 1.0) == pytest.approx(0)
    turntable.set_speed(2.0, 1.0, now=101.0)
    assert azimuth_difference(turntable.azimuth_at(200.0), 1.0) == pytest.approx(0)


def test_at_rest_after_half_a_turn_another_speed_moves_nothing():
    for start_deg in range(0, 360, 15):
        goal = math.radians((start_deg + 180) % 360)
        turntable = Turntable(math.radians(start_deg))
        turntable.turn_to(goal, now=0.0)
        turntable.set_speed(0.5, 1.0, now=10.0)
        for now in (10.0, 12.0, 14.0, 30.0):
            apart = azimuth_difference(turntable.azimuth_at(now), goal)
            assert apart == pytest.approx(0, abs=1e-9)


def test_an_orbit_turns_as_a_turntable_does_and_keeps_its_elevation():
    orbit, turntable = Orbit(1.0, speed=0.5), Turntable(1.0, 0.5)
    for motion in (orbit, turntable):
        motion.turn_to(5.5, now=2.0)
    for time in np.linspace(2.0, 9.0, 50):
        assert orbit.at(time) == (turntable.azimuth_at(time), pytest.approx(CANONICAL_ELEVATION))


@pytest.mark.parametrize('elevation', [-1.2, -0.1, 0.0, 0.7, 1.5])
def test_an_orbit_goes_around_and_up_at_once_and_gets_to_the_view(elevation):
    orbit, goal = Orbit(0.3, 0.2, speed=0.5), orbit_camera(2.3, elevation)
    orbit.go_to(goal, now=1.0)
    assert orbit.at(1.0) == pytest.approx((0.3, 0.2))
    azimuth, height = orbit.at(1.2)
    assert azimuth == pytest.approx(0.4)
    assert abs(height - 0.2) == pytest.approx(min(0.1, abs(elevation - 0.2)))
    assert orbit.at(1.0 + max(2.0, abs(elevation - 0.2)) / 0.5) == pytest.approx((2.3, elevation))


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp('mesh') / 'box.ply'
    trimesh.creation.box((2, 1, 1)).export(path)
    return rendered_object(path, object_size=0.5, background=10)


def test_an_object_is_shown_by_the_nearest_of_its_views_and_says_which_it_is(shown):
    for azimuth in (0.0, 0.12, 6.2, 3.0):
        image, camera = shown.seen_from(azimuth)
        assert image.shape == (137, 137, 3)
        assert abs(azimuth_difference(camera.azimuth, azimuth)) <= math.radians(7.5)
        assert camera.distance == pytest.approx(CANONICAL_DISTANCE * 0.5)
    assert shown.seen_from(0.12)[0] is shown.seen_from(0.0)[0]


@pytest.fixture(scope='module')
def anywhere(tmp_path_factory):
    path = tmp_path_factory.mktemp('mesh') / 'box.ply'
    trimesh.creation.box((2, 1, 1)).export(path)
    return object_anywhere(path, object_size=0.5, background=10)


def test_an_object_seen_from_anywhere_is_seen_from_exactly_there(anywhere):
    for place in ((0.1, -0.4), (0.1, 1.4), (4.0, 0.0)):
        image, camera = anywhere.seen_from(*place)
        assert (camera.azimuth, camera.elevation) == pytest.approx(place)
        assert camera.distance == pytest.approx(CANONICAL_DISTANCE * 0.5)
        assert anywhere.seen_from(*place)[0] is image
    assert (anywhere.seen_from(0.1, 1.4)[0] != anywhere.seen_from(0.1, -0.4)[0]).any()


def test_on_the_turntable_s_own_places_both_show_the_same_image(shown, anywhere):
    for camera, image in zip(shown.cameras, shown.images, strict=True):
        rendered, own = anywhere.seen_from(camera.azimuth, CANONICAL_ELEVATION)
        assert (rendered != image).mean() < 0.01  # edges, where the azimuth was rounded
        np.testing.assert_allclose(own.pose, camera.pose, atol=1e-9)


def test_of_stored_images_that_in_the_nearest_direction_is_shown(shown):
    image, camera = shown.seen_from(0.12, 1.2)
    assert camera is shown.cameras[0]
    assert image is shown.images[0]


def test_the_background_shows_around_the_object(shown):
    image, _ = shown.seen_from(0.0)
    assert (image[0] == 10).all()
    assert not (image == 10).all()


def test_what_is_no_mesh_is_refused(tmp_path):
    (tmp_path / 'text.ply').write_text('no mesh')
    with pytest.raises(MeshError, match='no mesh that can be read'):
        rendered_object(tmp_path / 'text.ply')
    assert issubclass(MeshError, DataError)
