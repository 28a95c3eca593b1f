"""How the demo scores the loop's views, whatever network runs in it."""

from io import StringIO
from pathlib import Path

from active_recon.demo.run import Demo, follow_loop
from active_recon.errors import ActiveReconError
from active_recon.geometry.cameras import orbit_camera
from active_recon.launching.demo_monitor import DemoMonitor
from active_recon.volumes.voxels import VoxelGrid
from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_to_msg, NodeStatus
from msg_tools.episodes import done_to_msg
from msg_tools.loop import view_to_msgs
from msg_tools.stamps import stamp_from_nanoseconds
import numpy as np
import pytest
from rich.console import Console
from std_msgs.msg import Header

from .conftest import BUDGET_S, LATCHED_QOS

pytestmark = pytest.mark.ros


def publish_view(bench, truth, threshold=0.5):
    """Publish a view whose probabilities are above 0.5 where the truth is occupied."""
    grid = VoxelGrid(np.where(truth, np.float32(0.9), np.float32(0.3)))
    latent = np.zeros((4, 2, 2), np.float32)
    stamp = bench.now()
    messages = view_to_msgs(stamp, orbit_camera(1.0), grid, grid.above(threshold), latent, 7.0)
    for topic, msg in messages.items():
        bench.node.create_publisher(type(msg), topic, LATCHED_QOS).publish(msg)
    return stamp


@pytest.mark.parametrize('cells', [32, 64])
@pytest.mark.parametrize('threshold', [0.5, 1.0], ids=['occupied', 'nothing occupied'])
def test_a_view_is_measured_at_the_cells_of_its_network(bench, cells, threshold):
    truth = np.random.default_rng(0).random((cells,) * 3) < 0.5
    monitor = DemoMonitor(bench.node, bench.executor, lambda side: {cells: truth}[side])
    publish_view(bench, truth, threshold)
    monitor.until(lambda: monitor.has_views(1), BUDGET_S, 'the view', lambda: None)
    view, = monitor.state.views
    assert view.occupied.occupancy.shape == (cells,) * 3
    assert view.iou == float(threshold == 0.5)
    assert view.camera.azimuth == pytest.approx(1.0)
    assert 0 < view.latency < BUDGET_S


@pytest.mark.parametrize(('views', 'said'), [
    (1, ''), (3, '2 of the 3 views did not reach the table and the picture')])
def test_a_demo_whose_planner_is_done_waits_no_longer_for_views_that_were_missed(
        bench, views, said):
    truth = np.zeros((32,) * 3, bool)
    monitor = DemoMonitor(bench.node, bench.executor, lambda side: truth)
    console = Console(file=StringIO(), width=200)
    stamp = publish_view(bench, truth)
    done = bench.node.create_publisher(Header, 'done', LATCHED_QOS)
    done.publish(done_to_msg(stamp, 'max_views'))
    shown_views = []
    follow_loop(monitor, Demo(Path('chair.ply'), views), 'chair', console, lambda: None,
                shown_views.append)
    assert shown_views == list(monitor.state.views)
    assert [view.stamp for view in shown_views] == [stamp]
    shown = console.file.getvalue()
    assert 'done (max_views)' in shown
    assert said in shown if said else 'did not reach' not in shown


def test_a_demo_that_waits_in_vain_tells_what_the_nodes_report(bench):
    monitor = DemoMonitor(bench.node, bench.executor, lambda side: np.zeros((32,) * 3, bool))
    publisher = bench.node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    reported = NodeStatus('/view_planner', problem='policy: fails with IndexError')

    def report():
        publisher.publish(diagnostics_to_msg(reported, stamp_from_nanoseconds(bench.now())))

    with pytest.raises(ActiveReconError, match='expected view 2 within 1 s, but it did not '
                       'arrive; view_planner: policy: fails with IndexError'):
        monitor.until(lambda: monitor.has_views(2), 1.0, 'view 2', report)
