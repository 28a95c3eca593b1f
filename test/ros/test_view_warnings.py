"""What the reconstructor warns of after a view."""

from active_recon.nodes.loop.view_warnings import ViewWarnings
from active_recon.reconstructor import Reconstruction
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest

pytestmark = pytest.mark.ros


class Told:
    """The warnings that stand."""

    def __init__(self):
        self.standing = {}

    def raise_warning(self, kind, message):
        self.standing[kind] = message

    def clear_warning(self, kind, log=True):
        self.standing.pop(kind, None)

    def drop_value(self, name):
        pass


def known(first, last):
    cells = np.zeros((20, 20, 20), np.float32)
    cells[first:last, first:last, first:last] = 0.9
    return Reconstruction(VoxelGrid(cells, 0.4), np.zeros((1, 1, 1), np.float32),
                          np.zeros((2, 2, 3), np.uint8))


def test_a_wide_cube_is_warned_of_while_it_is_one_and_until_the_episode_ends():
    told = Told()
    warnings = ViewWarnings(told, needs_front=False)
    warnings.check_shape(known(5, 15), 0.4, 2)
    assert not told.standing
    warnings.check_shape(known(5, 15), 0.4, 3)
    assert 'object_size 0.2 fits it' in told.standing['cube']
    warnings.check_shape(known(0, 20), 0.4, 4)
    assert not told.standing
    warnings.check_shape(known(5, 15), 0.4, 5)
    warnings.clear()
    assert not told.standing
