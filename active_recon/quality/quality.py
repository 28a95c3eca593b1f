"""What is said of a reconstruction's quality after a view."""

from collections.abc import Mapping
from dataclasses import dataclass

FALSE_ALARMS = 0.05
"""The p-value up to which views are flagged: as often as this where nothing is wrong."""
SUSPECTS: Mapping[str, str] = {
    'pose': "what the views show does not fit together: are the camera's poses right?",
    'object_size': 'the object does not fit its cube: is object_size right?',
    'mask': 'silhouettes are cut off or have something added: is the mask, or the background that '
            'is removed, right?',
    'unknown': 'the images are unlike all that the network was trained on: is there an object in '
               'them, and of what kind?'}
"""What may be wrong with flagged views, with the question to ask."""
_PHOTO_SUSPECTS = {**SUSPECTS, 'object_size': 'the object does not fit its cube: is the cube '
                                              '(--box, --size) right?'}


@dataclass(frozen=True)
class Quality:
    """
    The quality of a reconstruction, as it is judged without the truth.

    - expected_iou: the expected IoU with the truth, in [0, 1]
    - lower_bound: the IoU that at least 90 % of objects exceed after as many views
    - promise: the largest `target_quality` at which an episode may stop now, so that at most one
      in ten that stop are below it, in whatever order views are taken; 0 if there is none
    - attainable: the IoU that at most 5 % of such objects exceed with as many views as were
      measured
    - p_value: how often views of known objects, without a fault, are as unusual, in (0, 1]
    - silhouette_iou: mean over views of the IoU of the predicted and the seen silhouette
    - suspect: the most likely of SUSPECTS where the p-value is at most FALSE_ALARMS, else ''
    - promise_learned: the promise where the learned policy of the weights chooses the views on a
      turntable; None where it is not told, in bags of earlier versions
    """

    expected_iou: float
    lower_bound: float
    promise: float
    attainable: float
    p_value: float
    silhouette_iou: float
    suspect: str = ''
    promise_learned: float | None = None

    def promise_for(self, learned: bool) -> float:
        """Return the promise where the learned policy goes around a turntable or not."""
        return self.promise if self.promise_learned is None or not learned else (
            self.promise_learned)

    @property
    def summary(self) -> str:
        """The IoU in words: expected, and what it is at least."""
        return f'expected IoU {self.expected_iou:.2f}, at least {self.lower_bound:.2f}'

    @property
    def warning(self) -> str:
        """The warning in words, '' where nothing is suspected."""
        return self._asking(SUSPECTS)

    @property
    def photo_warning(self) -> str:
        """The same for a shape of photos alone, whose cube is set by other options."""
        return self._asking(_PHOTO_SUSPECTS)

    def _asking(self, questions: Mapping[str, str]) -> str:
        if not self.suspect:
            return ''
        return f'unusual views (p = {self.p_value:.3f}): {questions[self.suspect]}'
