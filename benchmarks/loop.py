"""The nodes, over real ROS 2: ready time, memory, latency, and the whole demo."""

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.launching.processes import NodeProcesses, private_environment
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from benchmarks.core import OBJECTS
from benchmarks.figures import Figure
from benchmarks.memory import peak_mb

_READY_STARTS = 5
_VIEWS = 200
_DEMOS = 3
_BUDGET_S = 30.0


def reconstructor_figures() -> list[Figure]:
    """Start the reconstructor some times; send views to the last and wait for each occupancy."""
    ready: list[float] = []
    memory_mb: list[float] = []
    latency_ms: list[float] = []
    for _ in range(_READY_STARTS):
        with reconstructor_process() as (seconds, process):
            ready.append(seconds)
            if len(ready) == _READY_STARTS:
                latency_ms = _latencies_ms()
                memory_mb = [peak_mb(process)]
    return [
        Figure('image published to occupancy received, p95', 'ms', latency_ms, 50, percentile=95),
        Figure('reconstructor ready after its start', 's', ready, 0.5),
        Figure(f'reconstructor memory, peak over {_VIEWS} views', 'MB', memory_mb, 150)]


def demo_figure() -> Figure:
    """Run the whole demo, as a user starts it, with the attention policy."""
    spent = []
    for _ in range(_DEMOS):
        with TemporaryDirectory() as folder:
            start = time.monotonic()
            subprocess.run([sys.executable, '-m', 'active_recon.cli.main', 'demo'], check=True,
                           cwd=folder, stdout=subprocess.DEVNULL,
                           env={**os.environ, 'PYTHONPATH': str(Path(__file__).parents[1])})
            spent.append(time.monotonic() - start)
    return Figure('the whole demo', 's', spent, 10)


@contextmanager
def reconstructor_process() -> Iterator[tuple[float, int]]:
    """Start a reconstructor that takes every image; yield the seconds it took, and its pid."""
    environment = private_environment()
    os.environ.update(environment)
    with TemporaryDirectory() as logs, NodeProcesses(Path(logs), environment) as nodes:
        start = time.monotonic()
        nodes.start('reconstructor', {'take_views': 'all'})
        log = Path(logs, 'reconstructor.txt')
        while ']: ready' not in log.read_text():
            nodes.check()
            if time.monotonic() - start > _BUDGET_S:
                raise TimeoutError(f'the reconstructor was not ready in {_BUDGET_S} s')
            time.sleep(0.01)
        yield time.monotonic() - start, nodes.pid('reconstructor')


def _latencies_ms() -> list[float]:
    """Publish views one by one as a camera would; return how long each occupancy took."""
    from active_recon.launching.loop_client import joined_domain
    from active_recon.nodes.runtime.qos import LATCHED_QOS
    from geometry_msgs.msg import PoseStamped
    from msg_tools.cameras import intrinsics_to_msg, pose_to_msg
    from msg_tools.images import image_to_msg
    from sensor_msgs.msg import CameraInfo, Image, PointCloud2
    from std_msgs.msg import Header

    with joined_domain('benchmark') as (node, executor):
        arrived: list[float] = []
        node.create_subscription(
            PointCloud2, 'occupancy', lambda _: arrived.append(time.perf_counter()), LATCHED_QOS)
        publishers = [node.create_publisher(kind, topic, 10) for kind, topic in (
            (CameraInfo, 'camera/camera_info'), (PoseStamped, 'camera/pose'),
            (Image, 'camera/image_raw'))]
        renderer = Renderer(load_mesh(OBJECTS / 'chair.glb'))
        cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
        images = [composite(renderer.render(camera), 255) for camera in cameras]

        def spin_until(condition: object, what: str) -> None:
            deadline = time.monotonic() + _BUDGET_S
            while not condition():  # type: ignore[operator]
                if time.monotonic() > deadline:
                    raise TimeoutError(f'waited {_BUDGET_S} s in vain for {what}')
                executor.spin_once(timeout_sec=0.05)

        spin_until(lambda: all(p.get_subscription_count() for p in publishers),
                   'the reconstructor')
        spin_until(lambda: node.count_publishers('occupancy') > 0, 'its publishers')
        latencies = []
        for turn in range(_VIEWS):
            index = turn % len(cameras)
            header = Header(stamp=node.get_clock().now().to_msg(), frame_id='object')
            known = len(arrived)
            messages = (intrinsics_to_msg(cameras[index].intrinsics, header),
                        pose_to_msg(cameras[index].pose, header),
                        image_to_msg(images[index], header))
            start = time.perf_counter()
            for publisher, message in zip(publishers, messages, strict=True):
                publisher.publish(message)
            spin_until(lambda known=known: len(arrived) > known, f'occupancy {turn}')
            latencies.append(1e3 * (arrived[-1] - start))
        return latencies
