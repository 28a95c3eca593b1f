"""How the demo scores the loop's views, whatever network runs in it."""

from active_recon.geometry.cameras import orbit_camera
from active_recon.launching.demo_monitor import DemoMonitor
from active_recon.volumes.voxels import VoxelGrid
from msg_tools.loop import view_to_msgs
import numpy as np
import pytest

from .conftest import BUDGET_S, LATCHED_QOS

pytestmark = pytest.mark.ros


@pytest.mark.parametrize('cells', [32, 64])
@pytest.mark.parametrize('threshold', [0.5, 1.0], ids=['occupied', 'nothing occupied'])
def test_a_view_is_measured_at_the_cells_of_its_network(bench, cells, threshold):
    truth = np.random.default_rng(0).random((cells,) * 3) < 0.5
    monitor = DemoMonitor(bench.node, bench.executor, lambda side: {cells: truth}[side])
    grid = VoxelGrid(np.where(truth, np.float32(0.9), np.float32(0.3)))
    latent = np.zeros((4, 2, 2), np.float32)
    stamp = bench.now()
    messages = view_to_msgs(stamp, orbit_camera(1.0), grid, grid.above(threshold), latent, 7.0)
    for topic, msg in messages.items():
        bench.node.create_publisher(type(msg), topic, LATCHED_QOS).publish(msg)
    monitor.until(lambda: monitor.has_views(1), BUDGET_S, 'the view', lambda: None)
    view, = monitor.state.views
    assert view.occupied.occupancy.shape == (cells,) * 3
    assert view.iou == float(threshold == 0.5)
    assert view.camera.azimuth == pytest.approx(1.0)
    assert 0 < view.latency < BUDGET_S
