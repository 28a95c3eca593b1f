"""Fitting the tables that quality is judged by."""

from collections.abc import Sequence
from dataclasses import fields

from active_recon.errors import DataError
from active_recon.evaluation.quality.faults import FAULTS
from active_recon.evaluation.quality.measuring import LEARNED, Measured
from active_recon.evaluation.quality.promises import Episodes, needed_for, one_of_each
from active_recon.evaluation.quality.shells import HOLLOW
from active_recon.quality.conformal import upper_quantile
from active_recon.quality.judge import expected_iou, standardised
from active_recon.quality.latents import KnownLatents
from active_recon.quality.tables import Heads, QualityTables
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
    `calibration` are learned, and those that it lacks never suspected; its other rows calibrate,
    see `calibrated`. Raises DataError where one of the parts is empty, `known` is a single row,
    has faults, or all of it is hollow.
    """
    if (known.fault != '').any():
        raise DataError('quality: known objects with faults: expected those without, got '
                        f'{", ".join(sorted(set(known.fault.tolist()) - {""}))}; give '
                        'their files by --calibration')
    for name, part in (('known', known), ('known solid', known.solid)):
        if not len(part):
            raise DataError(f'quality: no {name} objects: expected some to fit with, got none')
    faulty = calibration.rows(calibration.fault != '')
    if not len(faulty):
        raise DataError('quality: no faulty objects: expected some in the half of --calibration '
                        'that is used, measured with --fault, got none')
    if len(known) < 2:
        raise DataError('quality: a single known reconstruction: expected two or more to tell '
                        'what is usual, got one; measure more objects or views')
    counts = int(calibration.count[calibration.fault == ''].max(initial=1))
    latents = KnownLatents.of(known.latents)
    given = numbers_of(known, latents)
    centre, scale = _plain(given.mean(axis=0)), _plain(given.std(axis=0) + 1e-6)
    known_z = standardised(given, centre, scale)
    head, intercepts = _head(known_z[known.hollow <= HOLLOW], known.solid, counts)
    suspects = tuple(name for name in FAULTS if (faulty.fault == name).any())
    fault_head = _softmax_head(
        [known_z, *(standardised(numbers_of(faulty.rows(faulty.fault == name), latents),
                                 centre, scale) for name in suspects)])
    return calibrated(Heads(
        sha256, centre, scale, _plain(head), _plain(intercepts), _plain(latents.mean),
        [_plain(row) for row in latents.whitening], suspects,
        [_plain(row) for row in fault_head]), calibration)


def calibrated(heads: Heads, calibration: Measured) -> QualityTables:
    """
    Return tables of heads whose quantiles and promises are those of new objects.

    Nothing may have been fitted to the objects; rows with a fault are left out, and all but one
    episode of an object in one kind of views: the others are not independent. What is said of
    the IoU is calibrated on objects that are not hollow: of others no view tells what is inside.
    Bounds and promises hold in every kind of views by itself; what is usual is told apart for
    turntables and for any cameras. Raises DataError where there is no object, or there are fewer
    views than the heads have numbers of views for.
    """
    counts = range(1, len(heads.intercepts) + 1)
    usual = calibration.rows((calibration.fault == '') & (calibration.count <= counts[-1]))
    usual = usual.rows(one_of_each(usual))
    if missing := set(counts) - set(usual.solid.count.tolist()):
        raise DataError('quality: no objects to calibrate with after some numbers of views: '
                        f'expected solid ones without a fault after 1 to {counts[-1]}, got none '
                        f'after {", ".join(map(str, sorted(missing)))}; measure some with '
                        f'`--views {counts[-1]}`')
    own = numbers_of(usual, heads.known_latents)
    z = standardised(own, heads.centre, heads.scale)
    expected = expected_iou(z, heads.head, np.asarray(heads.intercepts)[usual.count - 1])
    scores = logsumexp(_with_one(z) @ np.asarray(heads.fault_head).T, axis=1)
    right, ahead = usual.solid, expected[usual.hollow <= HOLLOW]
    needed = {kind: _needed(right.rows(right.kind == kind), ahead[right.kind == kind])
              for kind in np.unique(right.kind).tolist()}
    of_turntable = usual.around if usual.around.any() else np.ones(len(usual), np.bool_)

    def bound(over: Matrix, miss: float) -> list[float]:
        """Return what few of any kind of views exceed after each number of them, (K,)."""
        return _plain([min(1.0, max(upper_quantile(over[rows], miss) for kind in needed if (
            rows := (right.kind == kind) & (right.count == number)).any())) for number in counts])

    def ordered(values: Matrix, chosen: NDArray[np.bool_]) -> list[list[float]]:
        return [_plain(np.sort(values[chosen & (usual.count == number)]))
                for number in counts] if chosen.any() else []

    return QualityTables(
        **{each.name: getattr(heads, each.name) for each in fields(Heads)},
        margin=bound(ahead - right.iou, MISS),
        targets=TARGETS, needed=_plain(np.max(list(needed.values()), axis=0)),
        growth=bound(_best_from_then(right) - ahead, TOP),
        usual_scores=ordered(scores, of_turntable),
        usual_distances=ordered(own[:, -1], of_turntable),
        needed_learned=_plain(needed.get(LEARNED, [])),
        usual_scores_any=ordered(scores, ~of_turntable),
        usual_distances_any=ordered(own[:, -1], ~of_turntable))


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


def _best_from_then(usual: Measured) -> Matrix:
    """Return the best IoU of each row's episode from its view on, (N,)."""
    _, rows = np.unique(usual.episode, return_inverse=True)
    iou = Episodes.of(usual, usual.iou).iou
    return np.asarray(np.fmax.accumulate(iou[:, ::-1], axis=1)[:, ::-1][rows, usual.count - 1])


def _with_one(z: Matrix) -> Matrix:
    return np.column_stack([z, np.ones(len(z))])


def _plain(values: Sequence[float] | Matrix) -> list[float]:
    return [round(float(value), _DIGITS) for value in values]
