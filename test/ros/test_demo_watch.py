"""What the demo makes of the loop's messages, whatever network runs in it."""

from types import SimpleNamespace

from active_recon.geometry.cameras import orbit_camera
from active_recon.launching.demo_watch import DemoWatch
from active_recon.volumes.voxels import VoxelGrid
from msg_tools.loop import view_to_msgs
import numpy as np
import pytest


class Heard:
    """Stands for a node: what is published is heard at once."""

    def __init__(self):
        self.callbacks = {}

    def create_subscription(self, _kind, topic, callback, _qos):
        self.callbacks[topic] = callback

    def say(self, messages):
        for topic, msg in messages.items():
            self.callbacks.get(topic, lambda _: None)(msg)


@pytest.mark.parametrize('cells', [32, 64])
@pytest.mark.parametrize('threshold', [0.5, 1.0], ids=['occupied', 'nothing occupied'])
def test_a_view_is_measured_at_the_cells_of_its_network(cells, threshold):
    node = Heard()
    truth = np.random.default_rng(0).random((cells,) * 3) < 0.5
    watch = DemoWatch(node, SimpleNamespace(), lambda side: {cells: truth}[side])
    grid = VoxelGrid(np.where(truth, np.float32(0.9), np.float32(0.3)))
    latent = np.zeros((4, 2, 2), np.float32)
    node.say(view_to_msgs(5, orbit_camera(1.0), grid, grid.above(threshold), latent, 7.0))
    view, = watch.views
    assert view.occupied.occupancy.shape == (cells,) * 3
    assert view.iou == float(threshold == 0.5)
    assert view.azimuth == pytest.approx(1.0)
