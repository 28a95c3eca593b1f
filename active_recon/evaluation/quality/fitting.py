"""Fitting the tables that quality is judged by."""

from collections.abc import Sequence

from active_recon.errors import DataError
from active_recon.evaluation.quality.faults import FAULTS
from active_recon.evaluation.quality.measuring import LEARNED, Measured
from active_recon.evaluation.quality.promises import Episodes, needed_for
from active_recon.evaluation.quality.shells import HOLLOW
from active_recon.quality.conformal import upper_quantile
from active_recon.quality.judge import expected_iou, standardised
from active_recon.quality.latents import KnownLatents
from active_recon.quality.tables import QualityTables
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax, logsumexp, softmax

TARGETS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
MISS, TOP = 0.1, 0.05
_RIDGE, _SOFT_RIDGE = 30.0, 1.0
_EDGE = 0.02
_DIGITS = 6
Matrix = NDArray[np.float64]


def fit(known: Measured, calibration: Measured, sha256: str) -> QualityTables:
    """
    Return the tables of the network with a SHA-256.

    `known` objects, without faults, and of which the network may have seen some, give the
    latents, the head, and what usual views are like beside those with a fault. The faults of
    `calibration` are learned; its other rows, of objects that nothing was fitted to, give all
    quantiles and promises. What is said of the IoU is fitted to objects that are not hollow: of
    others no view tells what is inside. Raises DataError where one of the parts is empty.
    """
    usual = calibration.rows(calibration.fault == '')
    faulty = calibration.rows(calibration.fault != '')
    for name, part in (('known', known), ('calibration', usual), ('faulty', faulty)):
        if not len(part):
            raise DataError(f'quality: no {name} objects: expected some to fit with, got none')
    latents = KnownLatents.of(known.latents)
    given = numbers_of(known, latents)
    solid = known.hollow <= HOLLOW
    centre, scale = given.mean(axis=0), given.std(axis=0) + 1e-6
    counts = int(usual.count.max())
    known_z = standardised(given, list(centre), list(scale))
    head, intercepts = _head(known_z[solid], known.solid, counts)
    suspects = tuple(FAULTS)
    fault_head = _softmax_head(
        [known_z, *(standardised(numbers_of(faulty.rows(faulty.fault == name), latents),
                                 list(centre), list(scale)) for name in suspects)])
    own = numbers_of(usual, latents)
    z = standardised(own, list(centre), list(scale))
    expected = expected_iou(z, list(head), intercepts[usual.count - 1])
    scores = logsumexp(_with_one(z) @ fault_head.T, axis=1)
    judged = usual.hollow <= HOLLOW
    right, ahead = usual.solid, expected[judged]
    of = [usual.count == number for number in range(1, counts + 1)]
    needed = {kind: _needed(right.rows(right.kind == kind), ahead[right.kind == kind])
              for kind in np.unique(right.kind).tolist()}
    return QualityTables(
        sha256, _plain(centre), _plain(scale), _plain(head), _plain(intercepts),
        _plain([min(upper_quantile((ahead - right.iou)[right.count == number], MISS), 1.0)
                for number in range(1, counts + 1)]),
        TARGETS, _plain(np.max(list(needed.values()), axis=0)), _growth(right, ahead),
        _plain(latents.mean),
        [_plain(row) for row in latents.whitening], suspects,
        [_plain(row) for row in fault_head],
        [_plain(np.sort(scores[rows])) for rows in of],
        [_plain(np.sort(own[rows, -1])) for rows in of], _plain(needed.get(LEARNED, [])))


def numbers_of(measured: Measured, latents: KnownLatents) -> Matrix:
    """Return the features with the latents' distances, (N, F)."""
    return np.column_stack([measured.numbers, latents.distances(measured.latents)])


def _head(z: Matrix, measured: Measured, counts: int) -> tuple[Matrix, Matrix]:
    """Return weights (2 F,) and intercepts (K,) of the log odds of the IoU; ridge regression."""
    iou = measured.iou.clip(_EDGE, 1 - _EDGE)
    number = measured.count.clip(1, counts) - 1
    inputs = np.column_stack([z, z ** 2, np.eye(counts)[number]])
    penalty = np.full(inputs.shape[1], _RIDGE)
    penalty[-counts:] = 1e-3
    found = np.linalg.solve(inputs.T @ inputs + np.diag(penalty), inputs.T @ np.log(
        iou / (1 - iou)))
    weights, intercepts = found[:-counts], found[-counts:]
    seen = np.flatnonzero(np.bincount(number, minlength=counts))
    return weights, np.interp(np.arange(counts), seen, intercepts[seen])


def _softmax_head(classes: Sequence[Matrix]) -> Matrix:
    """
    Return the log odds of each class against the first, (classes - 1, F + 1), of (N, F) each.

    Multinomial regression; all classes have the same weight.
    """
    inputs = _with_one(np.concatenate(classes))
    label = np.repeat(np.arange(len(classes)), [len(each) for each in classes])
    weight = 1 / np.array([len(each) for each in classes])[label] / len(classes)
    shape = len(classes) - 1, inputs.shape[1]
    aim = np.eye(len(classes))[label]

    def loss(flat: Matrix) -> tuple[float, Matrix]:
        head = flat.reshape(shape)
        odds = np.column_stack([np.zeros(len(inputs)), inputs @ head.T])
        apart = ((softmax(odds, axis=1) - aim) * weight[:, None])[:, 1:]
        penalty = _SOFT_RIDGE / len(inputs)
        value = -(weight * log_softmax(odds, axis=1)[np.arange(len(label)), label]).sum()
        return (float(value + penalty * (flat ** 2).sum() / 2),
                (apart.T @ inputs).ravel() + penalty * flat)

    found = minimize(loss, np.zeros(shape[0] * shape[1]), jac=True, method='L-BFGS-B',
                     options={'maxiter': 2000})
    return np.asarray(found.x.reshape(shape))


def _needed(usual: Measured, expected: Matrix) -> list[float]:
    """Return the expected IoU that each of TARGETS needs in one order of the views."""
    episodes = Episodes.of(usual, expected)
    return [needed_for(target, episodes) for target in TARGETS]


def _growth(usual: Measured, expected: Matrix) -> list[float]:
    """Return what the best IoU from then on exceeds the expected one by in 5 % of episodes."""
    episodes = Episodes.of(usual, expected)
    best = np.fmax.accumulate(episodes.iou[:, ::-1], axis=1)[:, ::-1]
    ahead = best - episodes.expected
    return _plain([min(upper_quantile(column[~np.isnan(column)], TOP), 1.0) for column in ahead.T])


def _with_one(z: Matrix) -> Matrix:
    return np.column_stack([z, np.ones(len(z))])


def _plain(values: Sequence[float] | Matrix) -> list[float]:
    return [round(float(value), _DIGITS) for value in values]
