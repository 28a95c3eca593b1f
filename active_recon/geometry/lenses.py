"""
Lens distortion: the models of sensor_msgs/CameraInfo, which are OpenCV's.

The formulas are those of OpenCV's modules calib3d (plumb_bob, rational_polynomial) and fisheye
(equidistant).
"""

from dataclasses import dataclass
from functools import cached_property
import math

from active_recon.errors import ViewError
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

MODELS = {'plumb_bob': (4, 5), 'rational_polynomial': (8, 12), 'equidistant': (4,)}
"""The allowed numbers of coefficients of each model, in OpenCV's order: k1, k2, p1, p2, k3, ..."""
_LARGEST = 1e6  # larger than in any lens, and its sixth power does not overflow
_STEP = 1e-6
_CLOSE = 1e-10  # at depth 1
_HALVINGS = 6  # of a step of Newton's that leads away
_MOST_STEPS = 60  # of them, for the few points beside the fold
_STEEPEST = 3.0  # of any lens: beyond, a model is beside a pole, as fits of 8 coefficients have
_WITHIN = 0.9999  # at the maximum radius itself a model may divide by 0


@dataclass(frozen=True)
class Distortion:
    """
    A distortion model of `MODELS` and its coefficients.

    It maps normalised image points, (N, 2), x right and y down at depth 1. Coefficients may be in
    an array of any shape, as OpenCV returns them. Raises ViewError on an unknown model, a wrong
    number of coefficients, and coefficients that are not finite.
    """

    model: str
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        """Keep a tuple of the coefficients; reject unknown models and invalid coefficients."""
        if self.model not in MODELS:
            raise ViewError(f'unknown distortion model: expected one of {", ".join(MODELS)}, got '
                            f'{self.model!r}; publish rectified images instead', 'camera_info')
        object.__setattr__(
            self, 'coefficients', tuple(map(float, np.ravel(self.coefficients))))
        counts, given = MODELS[self.model], len(self.coefficients)
        if given not in counts:
            raise ViewError('wrong number of distortion coefficients: expected '
                            f'{" or ".join(map(str, counts))} of {self.model}, got '
                            f'{given}', 'camera_info')
        if not all(abs(value) <= _LARGEST for value in self.coefficients):
            raise ViewError('invalid distortion coefficients: expected finite ones, got '
                            f'{self.coefficients}', 'camera_info')

    def distort(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return normalised points (N, 2) after distortion, (N, 2); see `distorted`."""
        return np.column_stack(self.distorted(points[:, 0], points[:, 1]))

    def distorted(self, x: NDArray[np.float64], y: NDArray[np.float64]
                  ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """
        Return normalised x and y, (...) each, after distortion.

        Beyond `max_radius`, where the model would fold back towards the centre, the displacement
        is held constant, so that points outside of the field of view stay outside of the image.
        """
        square = x * x + y * y
        if square.max(initial=0.0) <= self.max_radius ** 2:
            return self._modelled(x, y, square)
        radius = np.hypot(x, y)
        beyond = np.maximum(radius - self.max_radius, 0.0)
        across, down = (each / np.maximum(radius, 1e-12) for each in (x, y))
        near_x, near_y = x - beyond * across, y - beyond * down
        bent_x, bent_y = self._modelled(near_x, near_y, near_x * near_x + near_y * near_y)
        return bent_x + beyond * across, bent_y + beyond * down

    def undistort(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """
        Return distorted points (N, 2) without the distortion, (N, 2): the inverse of `distort`.

        Found by Newton's method, until their distortion is within 1e-10 of the points.
        """
        found, open_ones = points.copy(), np.arange(len(points))
        wrong = self.distort(points) - points
        for _ in range(_MOST_STEPS):  # a handful is enough but at the edge of the field
            near, there = found[open_ones], points[open_ones]
            across, down = ((self.distort(near + step) - self.distort(near - step)) / (2 * _STEP)
                            for step in np.eye(2) * _STEP)
            determinant = across[:, 0] * down[:, 1] - across[:, 1] * down[:, 0]
            step = np.column_stack([
                wrong[:, 0] * down[:, 1] - wrong[:, 1] * down[:, 0],
                wrong[:, 1] * across[:, 0] - wrong[:, 0] * across[:, 1]]) / determinant[:, None]
            left = self.distort(near - step) - there
            for _ in range(_HALVINGS):  # near its fold the model is flat, and steps are long
                away = np.linalg.norm(left, axis=1) > np.linalg.norm(wrong, axis=1)
                if not away.any():
                    break
                step[away] /= 2
                left[away] = self.distort((near - step)[away]) - there[away]
            found[open_ones] = near - step
            still = np.abs(left).max(axis=1) > _CLOSE
            open_ones, wrong = open_ones[still], left[still]
            if not len(open_ones):
                break
        return found

    @cached_property
    def max_radius(self) -> float:
        """The undistorted radius, at depth 1, up to which the model is monotonic."""
        k = self.coefficients
        if self.model == 'equidistant':
            angle = math.sqrt(_first_root(Polynomial([1, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]])))
            return _WITHIN * (math.tan(angle) if angle < math.pi / 2 - 1e-3 else 1e3)
        # r N(s) / D(s), with s the square of the radius r, folds where its derivative is 0
        s, n, d = Polynomial([0, 1]), Polynomial([1, *k[:2], *k[4:5]]), Polynomial([1, *k[5:8]])
        turns = (n + 2 * s * n.deriv()) * d - 2 * s * n * d.deriv()
        return _WITHIN * math.sqrt(min(
            _first_root(turns), _first_root(d), _first_root(turns - _STEEPEST * d * d)))

    def _modelled(self, x: NDArray[np.float64], y: NDArray[np.float64],
                  r2: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return OpenCV's model at x, y, r2 = x^2 + y^2; its own function is far slower."""
        if self.model == 'equidistant':
            radius = np.sqrt(r2)
            angle = np.arctan(radius)
            bent = angle * np.polynomial.polynomial.polyval(angle**2, [1, *self.coefficients])
            bent /= np.maximum(radius, 1e-12)
            return x * bent, y * bent
        k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = (*self.coefficients, *[0.0] * 8)[:12]
        along = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if k4 or k5 or k6:
            along /= 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        xy = 2 * x * y
        bent_x = x * along + p1 * xy + p2 * (r2 + 2 * x * x)
        bent_y = y * along + p1 * (r2 + 2 * y * y) + p2 * xy
        if s1 or s2 or s3 or s4:
            bent_x += r2 * (s1 + r2 * s2)
            bent_y += r2 * (s3 + r2 * s4)
        return bent_x, bent_y


def _first_root(polynomial: Polynomial) -> float:
    """Return the smallest positive root of what is not 0 at 0; a million where there is none."""
    # Their inverses are exact where the highest coefficients are 0 but for rounding
    inverses = Polynomial(polynomial.coef[::-1]).roots()
    real = inverses[np.abs(inverses.imag) < 1e-9].real
    return float(min(1 / real[real > 1e-6], default=1e6))
