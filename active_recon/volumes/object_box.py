"""The box about the object in a grid, without what hovers beside it."""

import numpy as np
from numpy.typing import NDArray


def object_box(occupied: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """
    Return the box of the largest connected part, (2, 3), in sides of the cube from its centre.

    None where nothing is occupied.
    """
    from scipy.ndimage import find_objects, label  # a node that never asks does without

    labels, count = label(occupied)
    if not count:
        return None
    largest = int(np.bincount(labels.ravel())[1:].argmax())
    spans = find_objects(labels)[largest]
    ends = np.array([[span.start, span.stop] for span in spans], np.float64).T
    return ends / len(occupied) - 0.5
