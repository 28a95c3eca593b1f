"""Calibration of occupancies as probabilities, measured near the surface."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.optimize import minimize, minimize_scalar
from scipy.special import expit

Cells = NDArray[np.bool_]
BINS = 15
REACH = 2  # cells
_COLDEST, _HOTTEST = 0.05, 20.0


def near_surface(truth: Cells, reach: int = REACH) -> Cells:
    """
    Return the cells within `reach` cells of the boundary of a shape, (X, Y, Z).

    Cells far from it are certainly full or empty, so they would improve any calibration measure.
    Outside of the grid everything counts as empty.
    """
    return np.asarray(binary_dilation(truth, iterations=reach)
                      & ~binary_erosion(truth, iterations=reach))


def brier(occupancy: NDArray[np.floating], truth: Cells) -> float:
    """Return the Brier score, [0, 1]: the mean squared error of occupancies (N,), truth (N,)."""
    return float(np.square(occupancy - truth).mean())


def reliability(occupancy: NDArray[np.floating], truth: Cells,
                bins: int = BINS) -> NDArray[np.float64]:
    """
    Return a reliability diagram of occupancies (N,) in [0, 1], (3, bins).

    For each bin of equal width: the number of cells, the sum of their occupancies, and the number
    of full cells. Diagrams of several objects can be added.
    """
    place = np.minimum((occupancy * bins).astype(np.intp), bins - 1)
    return np.stack([np.bincount(place, weights, bins).astype(np.float64)
                     for weights in (None, occupancy, truth)])


def calibration_error(diagram: NDArray[np.float64]) -> float:
    """
    Return the expected calibration error of a reliability diagram (3, bins): 0 (perfect) to 1.

    The ECE of Guo et al., "On calibration of modern neural networks", 2017, equation 3.
    """
    count, expected, full = diagram
    return float(np.abs(expected - full).sum() / count.sum()) if count.any() else 0.0


def fit_temperatures(logits_by_count: Mapping[int, NDArray[np.floating]],
                     truth: Cells) -> dict[int, float]:
    """
    Return the temperature with the highest likelihood for each number of views.

    Takes the logits of the same cells (N,) after each number of views, and their truth (N,).
    Logits are divided by the temperature, which is above 1 where they are overconfident
    (temperature scaling, Guo et al. 2017). The negative log-likelihood has one minimum.
    """
    return {count: _temperature(np.asarray(logits, np.float64), truth)
            for count, logits in logits_by_count.items()}


def fit_logistic(inputs: NDArray[np.floating], truth: Cells) -> NDArray[np.float64]:
    """
    Return the weights (K,) and the bias of a logistic regression, (K + 1,).

    Takes inputs (N, K) and their truth (N,). It minimises the negative log-likelihood, which has
    one minimum; with a logit as the only input it is Platt scaling (Platt 1999).
    """
    design = np.column_stack([inputs, np.ones(len(inputs))]).astype(np.float64)

    def loss(weights: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        logits = design @ weights
        return (negative_log_likelihood(logits, truth),
                design.T @ (expit(logits) - truth) / len(truth))

    begun = np.zeros(design.shape[1])
    begun[0] = 1
    return np.asarray(minimize(loss, begun, jac=True, method='L-BFGS-B').x)


def negative_log_likelihood(logits: NDArray[np.floating], truth: Cells) -> float:
    """Return the mean negative log-likelihood of the truth (N,) under logits (N,), in nats."""
    return float(np.logaddexp(0, np.where(truth, -logits, logits)).mean())


def _temperature(logits: NDArray[np.float64], truth: Cells) -> float:
    found = minimize_scalar(
        lambda log: negative_log_likelihood(logits * np.exp(-log), truth),
        bounds=(np.log(_COLDEST), np.log(_HOTTEST)), method='bounded', options={'xatol': 1e-4})
    return float(np.exp(found.x))
