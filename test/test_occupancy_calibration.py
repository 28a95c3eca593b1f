"""Calibration is measured near the surface, and a temperature mends what is too sure."""

from active_recon.evaluation.calibration import (
    brier,
    calibration_error,
    fit_logistic,
    fit_temperatures,
    near_surface,
    negative_log_likelihood,
    reliability,
)
import numpy as np
import pytest
from scipy.special import expit


@pytest.fixture(scope='module')
def cells():
    """Return logits (N,) that are calibrated, and a truth drawn from them."""
    rng = np.random.default_rng(0)
    logits = rng.normal(0, 2, 100_000)
    return logits, rng.random(len(logits)) < expit(logits)


def test_the_cells_near_a_box_are_a_shell():
    truth = np.zeros((20, 20, 20), bool)
    truth[4:16, 4:16, 4:16] = True
    near = near_surface(truth)
    assert near[10, 10, [2, 3, 4, 5]].all() and not near[10, 10, [0, 1, 6, 10]].any()


def test_beyond_the_cube_is_empty():
    full = np.ones((8, 8, 8), bool)
    near = near_surface(full)
    assert near[0].all() and near[1].all() and not near[2:6, 2:6, 2:6].any()
    assert not near_surface(~full).any()


def test_calibrated_occupancies_have_no_error_and_sure_ones_do(cells):
    logits, truth = cells
    fair, sure = (calibration_error(reliability(expit(logits * by), truth)) for by in (1, 3))
    assert fair < 0.01 < 0.05 < sure
    assert brier(expit(logits), truth) < brier(expit(3 * logits), truth)


def test_diagrams_of_objects_add_up(cells):
    logits, truth = cells
    occupancy = expit(logits)
    parts = sum(reliability(occupancy[part], truth[part])
                for part in (slice(0, 300), slice(300, None)))
    np.testing.assert_allclose(parts, reliability(occupancy, truth))


def test_what_is_right_and_certain_has_no_error():
    truth = np.array([True, False, True])
    assert brier(truth.astype(float), truth) == 0
    assert calibration_error(reliability(truth.astype(float), truth)) == 0
    assert calibration_error(reliability(1.0 - truth, truth)) == 1
    assert calibration_error(reliability(np.empty(0), np.empty(0, bool))) == 0


def test_temperatures_find_what_logits_were_multiplied_by(cells):
    logits, truth = cells
    found = fit_temperatures({1: 3 * logits, 2: logits, 5: 0.5 * logits}, truth)
    assert found == pytest.approx({1: 3, 2: 1, 5: 0.5}, rel=0.03)


def test_a_logistic_fit_finds_the_line_that_made_the_truth():
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(200_000, 2))
    truth = rng.random(len(inputs)) < expit(inputs @ [1.5, -0.5] + 0.25)
    np.testing.assert_allclose(fit_logistic(inputs, truth), [1.5, -0.5, 0.25], atol=0.03)


def test_with_a_logit_alone_a_logistic_fit_is_no_less_likely_than_a_temperature(cells):
    logits, truth = cells
    seen = 2.3 * logits + 0.4
    scale, bias = fit_logistic(seen[:, None], truth)
    cooled = seen / fit_temperatures({1: seen}, truth)[1]
    assert (negative_log_likelihood(scale * seen + bias, truth)
            <= negative_log_likelihood(cooled, truth))


def test_no_other_temperature_is_more_likely(cells):
    logits, truth = cells
    best = fit_temperatures({1: 2.3 * logits + 0.4}, truth)[1]
    losses = [negative_log_likelihood((2.3 * logits + 0.4) / (best * by), truth)
              for by in (0.9, 1, 1.1)]
    assert losses[1] == min(losses)
