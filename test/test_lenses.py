"""Lenses distort straight lines, and the distortion can be undone."""

import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Intrinsics
from active_recon.geometry.lenses import Distortion
import cv2
import numpy as np
import pytest

LENSES = {
    'barrel': Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002, 0.01)),
    'pincushion': Distortion('plumb_bob', (0.2, 0.1, 0.0, 0.0)),
    'rational': Distortion('rational_polynomial',
                           (0.5, -0.2, 1e-4, -2e-4, -0.01, 0.8, -0.1, -0.05)),
    'thin prism': Distortion('rational_polynomial', (
        -0.2, 0.1, 0.001, -0.002, 0.01, 0.05, 0.01, 0.002, 0.003, -0.001, 0.002, 0.001)),
    'fisheye': Distortion('equidistant', (0.05, -0.02, 0.01, -0.004)),
}
EACH = pytest.mark.parametrize('lens', LENSES.values(), ids=LENSES)


def points(max_radius=0.6, count=500):
    return np.random.default_rng(0).uniform(-max_radius, max_radius, (count, 2))


@EACH
def test_a_lens_distorts_as_opencv_does(lens):
    pinhole, coefficients = np.eye(3), np.array(lens.coefficients)
    if lens.model == 'equidistant':
        expected = cv2.fisheye.distortPoints(points()[:, None], pinhole, coefficients)
    else:
        rays = np.column_stack([points(), np.ones(len(points()))])
        expected = cv2.projectPoints(
            rays[:, None], np.zeros(3), np.zeros(3), pinhole, coefficients)[0]
    np.testing.assert_allclose(lens.distort(points()), expected.reshape(-1, 2), atol=1e-12)


@EACH
def test_undistortion_inverts_distortion(lens):
    np.testing.assert_allclose(lens.undistort(lens.distort(points())), points(), atol=1e-9)


@pytest.mark.slow
def test_undistortion_ends_where_a_wide_lens_hardly_moves_any_more():
    # Beyond some 39 degrees the model folds, which its image's corners are near
    lens = Distortion('plumb_bob', (-0.42, 0.22, -0.001, 0.002, -0.07))
    x, y = ((np.arange(count) + 0.5 - count / 2) / 330 for count in (640, 480))
    image = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    apart = np.abs(lens.distort(lens.undistort(image)) - image).max(axis=1)
    assert apart.max() < 1e-3 and (apart < 1e-6).mean() > 0.999


def test_beside_a_nearly_cancelled_pole_hardly_anything_moves():
    # Calibrated for a TurtleBot 4: numerator and denominator nearly share a root, at 0.67
    lens, beyond = Distortion('rational_polynomial', (
        -4.8608, 17.2820, 0.000204, 0.001025, -25.1723, -4.9436, 17.5144, -25.2908)), points(0.9)
    assert np.abs(lens.distort(beyond) - beyond).max() < 0.05
    bent = lens.distort(points(0.66))
    np.testing.assert_allclose(lens.distort(lens.undistort(bent)), bent, atol=1e-6)


@EACH
def test_the_middle_stays_and_near_it_next_to_nothing_moves(lens):
    np.testing.assert_allclose(lens.distort(np.zeros((1, 2))), [[0, 0]], atol=1e-12)
    near = points(1e-3)
    np.testing.assert_allclose(lens.distort(near), near, atol=2e-8)


def test_a_lens_without_coefficients_is_a_pinhole_or_counts_angles():
    np.testing.assert_allclose(Distortion('plumb_bob', (0.0,) * 5).distort(points()), points())
    angles = Distortion('equidistant', (0.0,) * 4).distort(np.array([[math.tan(1.2), 0.0]]))
    np.testing.assert_allclose(angles, [[1.2, 0.0]])


@pytest.mark.parametrize('name', ['barrel', 'pincushion', 'rational', 'fisheye'])
def test_the_further_out_a_point_is_the_further_out_the_lens_shows_it(name):
    radii, lens = np.linspace(0, 50, 20_001), LENSES[name]
    for angle in np.linspace(0, math.tau, 7):
        line = radii[:, None] * [math.cos(angle), math.sin(angle)]
        shown = np.linalg.norm(lens.distort(line), axis=1)
        assert (np.diff(shown) > -1e-3 * np.diff(radii)).all()


def test_a_curve_that_turns_back_is_followed_to_where_it_does():
    assert Distortion('plumb_bob', (-0.3, 0.0, 0.0, 0.0)).max_radius == pytest.approx(
        math.sqrt(1 / 0.9), rel=1e-3)
    assert Distortion('equidistant', (-0.2, 0.0, 0.0, 0.0)).max_radius == pytest.approx(
        math.tan(math.sqrt(1 / 0.6)), rel=1e-3)
    assert Distortion('rational_polynomial', (0, 0, 0, 0, 0, 0, 0, 0)).max_radius > 999
    pole = Distortion('rational_polynomial', (0, 0, 0, 0, 0, -4.0, 0, 0))
    assert 0.25 < pole.max_radius < 0.5  # where it gets steep before the pole


@pytest.mark.parametrize('tiny', [1e-12, -1e-15, 1e-17, 1e-25, 1e-200])
def test_coefficients_that_are_0_but_for_rounding_are_0(tiny):
    for model, bent, nearly in (
            ('plumb_bob', (-0.3, 0, 0, 0, 0), (-0.3, tiny, 0, 0, 0)),
            ('plumb_bob', (-0.3, 0.1, 0, 0, -0.1), (-0.3, 0.1, tiny, tiny, -0.1)),
            ('equidistant', (-0.2, 0, 0, 0), (-0.2, tiny, 0, tiny)),
            ('rational_polynomial', (0, 0, 0, 0, 0, -4, 0, 0), (0, 0, 0, 0, tiny, -4, tiny, 0))):
        np.testing.assert_allclose(Distortion(model, nearly).distort(points(3)),
                                   Distortion(model, bent).distort(points(3)), atol=1e-6)


@pytest.mark.parametrize('shape', [(5,), (1, 5), (5, 1)])
def test_coefficients_in_an_array_are_those_of_a_tuple(shape):
    lens = LENSES['barrel']
    given = np.array(lens.coefficients).reshape(shape)
    own = Distortion('plumb_bob', given)
    given[:] = 0  # what is filled anew changes no lens of before
    assert own == lens and hash(own) == hash(lens)


def test_coefficients_without_a_model_are_no_lens():
    with pytest.raises(ViewError, match='expected a Distortion of .*, with its model, got a list'):
        Intrinsics(300, 300, 160, 120, 320, 240, [-0.2, 0.1, 0, 0, 0])


@pytest.mark.parametrize(('model', 'coefficients', 'said'), [
    ('kannala_brandt', (0.1,) * 4, "plumb_bob.*got 'kannala_brandt'; publish rectified"),
    ('', (0.1,) * 5, "got ''"),
    ('plumb_bob', (0.1,) * 3, 'coefficients: expected 4 or 5 of plumb_bob, got 3'),
    ('equidistant', (0.1,) * 5, 'coefficients: expected 4 of equidistant, got 5'),
    ('plumb_bob', (math.nan,) * 5, 'coefficients: expected finite.*nan'),
    ('plumb_bob', (1e30,) * 5, 'coefficients: expected finite')])
def test_what_no_lens_has_is_refused(model, coefficients, said):
    with pytest.raises(ViewError, match=said) as caught:
        Distortion(model, coefficients)
    assert caught.value.kind == 'camera_info'
