"""Judges the quality of reconstructions by a network's tables."""

from collections.abc import Sequence
import math

from active_recon.geometry.view_distance import on_one_ring
from active_recon.quality.conformal import p_value
from active_recon.quality.features import FEATURES, features
from active_recon.quality.latents import pooled
from active_recon.quality.quality import FALSE_ALARMS, Quality
from active_recon.quality.silhouettes import SeenView
from active_recon.quality.tables import QualityTables
import numpy as np
from numpy.typing import NDArray

_IOU = FEATURES.index('iou')
_FAR = 4.0
_TESTS = 2
FEWEST_USUAL = math.ceil(_TESTS / FALSE_ALARMS) - 1
"""Usual views that it takes for any to be flagged as unusual."""


class Judge:
    """Judges reconstructions of one network; keeps nothing from one to the next."""

    def __init__(self, tables: QualityTables) -> None:
        self._tables = tables
        self._known = tables.known_latents
        self._fault_head = np.array(tables.fault_head)

    def judge(self, occupancy: NDArray[np.floating], threshold: float,
              latent: NDArray[np.floating], views: Sequence[SeenView], count: int) -> Quality:
        """
        Return the quality of occupancies (R, R, R), kept above a threshold.

        Takes the latent (C, h, w), the views to compare silhouettes with, and the number of all
        views so far.
        """
        distance = self._known.distances(pooled(latent))
        around = on_one_ring(np.stack([view.camera.position for view in views]))
        return self.judge_numbers(
            np.append(features(occupancy, threshold, views), distance), count, around)

    def judge_numbers(self, numbers: NDArray[np.float64], count: int, around: bool) -> Quality:
        """
        Return the quality by the features and the latent's distance, (F,), after `count` views.

        `around`: they are of a turntable, which a first view does not tell.
        """
        row = min(count, len(self._tables.margin)) - 1
        scores, distances = self._tables.usual(around and count > 1)
        given = standardised(numbers, self._tables.centre, self._tables.scale)
        expected = float(expected_iou(
            given, self._tables.head, np.asarray(self._tables.intercepts[row])))
        by_fault = self._fault_head @ np.append(given, 1.0)
        # Either of two tests may flag, so each gets half of the false alarms
        p = min(1.0, _TESTS * min(
            p_value(float(np.logaddexp.reduce(by_fault)), scores[row]),
            p_value(float(numbers[-1]), distances[row])))
        suspect = self._tables.suspects[int(by_fault.argmax())] if p <= FALSE_ALARMS else ''
        promise, promise_learned = (
            promised(expected, self._tables.targets, self._tables.needed_where(learned))
            for learned in (False, True))
        return Quality(
            expected, _share(expected - self._tables.margin[row]), promise,
            _share(expected + self._tables.growth[row]), p, float(numbers[_IOU]), suspect,
            promise_learned)


def standardised(numbers: NDArray[np.float64], centre: Sequence[float],
                 scale: Sequence[float]) -> NDArray[np.float64]:
    """Return features (..., F) in their usual spread, kept within 4 of it."""
    found: NDArray[np.float64] = (numbers - np.asarray(centre)) / np.asarray(scale)
    return found.clip(-_FAR, _FAR)


def expected_iou(given: NDArray[np.float64], head: Sequence[float],
                 intercepts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the expected IoU (...) by standardised features (..., F) and intercepts (...)."""
    odds = np.concatenate([given, given ** 2], axis=-1) @ np.asarray(head) + intercepts
    return np.asarray(1 / (1 + np.exp(-odds)))


def promised(expected: float, targets: Sequence[float], needed: Sequence[float]) -> float:
    """Return the largest of the targets that an expected IoU is enough for, 0 if none is."""
    return max((target for target, least in zip(targets, needed, strict=True)
                if expected >= least), default=0.0)


def _share(value: float) -> float:
    """Return a value kept in [0, 1]."""
    return float(min(max(value, 0.0), 1.0))
