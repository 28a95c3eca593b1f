"""A camera's stream through the reconstructor: its latency, and what a large camera loses."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import time
from typing import Any

from active_recon.geometry.cameras import AZIMUTHS, CANONICAL_INTRINSICS, orbit_camera
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from benchmarks.core import OBJECTS
from benchmarks.figures import Figure
from benchmarks.loop import reconstructor_process
import cv2

_PERIOD_S = 0.2
_VIEWS = 150
_LARGE_VIEWS = 50
_LARGE = (4000, 3000)
_WAITED_S = 1.0  # for the last occupancy
_BUDGET_S = 30.0


def stream_figures() -> list[Figure]:
    """Send five images a second, small and raw, then of 12 megapixels as JPEG."""
    with reconstructor_process() as _, _camera() as send:
        latencies = counting_lost(send('raw', (640, 480), _VIEWS))
        large = send('jpeg', _LARGE, _LARGE_VIEWS)
    name = 'image published to occupancy received, 5 a second'
    return [
        Figure(f'{name}, p50', 'ms', latencies, 25),
        Figure(f'{name}, p99', 'ms', latencies, 60, percentile=99),
        Figure(f'the same, 12-megapixel JPEG, of {_LARGE_VIEWS}, p50', 'ms',
               [1e3 * spent for spent in large if spent], 40),
        Figure('12-megapixel JPEG, 5 a second: images that became views', '%',
               [100 * sum(map(bool, large)) / len(large)], 100, more_is_better=True)]


def counting_lost(spent: Sequence[float]) -> list[float]:
    """Return milliseconds of seconds; of an image without an occupancy, 0, what was waited."""
    return [1e3 * (each or _WAITED_S) for each in spent]


@contextmanager
def _camera() -> Iterator[Callable[[str, tuple[int, int], int], list[float]]]:
    """Yield what sends images at a rate and returns the seconds to each occupancy, 0: none."""
    from active_recon.launching.loop_client import joined_domain
    from active_recon.nodes.runtime.qos import LATCHED_QOS
    from geometry_msgs.msg import PoseStamped
    from msg_tools.cameras import camera_to_msgs
    from msg_tools.images import image_to_msg
    from msg_tools.stamps import nanoseconds_from_stamp
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
    from std_msgs.msg import Header

    with joined_domain('benchmark') as (node, executor):
        arrived: dict[int, float] = {}
        node.create_subscription(
            PointCloud2, 'occupancy', lambda msg: arrived.setdefault(
                nanoseconds_from_stamp(msg.header.stamp), time.perf_counter()), LATCHED_QOS)
        publishers = {kind: node.create_publisher(kind, f'camera/{topic}', 10) for kind, topic in (
            (CameraInfo, 'camera_info'), (PoseStamped, 'pose'), (Image, 'image_raw'),
            (CompressedImage, 'image_raw/compressed'))}

        def spin(until: float) -> None:
            while (left := until - time.perf_counter()) > 0:
                executor.spin_once(timeout_sec=left)

        def send(form: str, size: tuple[int, int], count: int) -> list[float]:
            views = views_of_size(size)
            messages = [_packed(CompressedImage, image) if form == 'jpeg'
                        else image_to_msg(image, Header()) for image, _ in views]
            sent: dict[int, float] = {}
            spin(time.perf_counter() + 2)  # the other form must have been silent for a while
            for turn in range(count):
                msg, (_, camera) = messages[turn % len(views)], views[turn % len(views)]
                msg.header = Header(stamp=node.get_clock().now().to_msg(), frame_id='camera')
                start = time.perf_counter()
                sent[nanoseconds_from_stamp(msg.header.stamp)] = start
                for part in (*camera_to_msgs(camera, msg.header), msg):
                    publishers[type(part)].publish(part)
                spin(start + _PERIOD_S)
            spin(time.perf_counter() + _WAITED_S)
            return [arrived[stamp] - start if stamp in arrived else 0.0
                    for stamp, start in sent.items()]

        deadline = time.perf_counter() + _BUDGET_S
        while not all(each.get_subscription_count() for each in publishers.values()):
            if time.perf_counter() > deadline:
                raise TimeoutError(f'waited {_BUDGET_S} s in vain for the reconstructor')
            executor.spin_once(timeout_sec=0.05)
        yield send


def views_of_size(size: tuple[int, int]) -> Sequence[tuple[Any, Any]]:
    """Return images of that size, and their cameras, which see the object as the canonical one."""
    renderer = Renderer(load_mesh(OBJECTS / 'chair.glb'))
    shorter = min(size)
    views = []
    for azimuth in AZIMUTHS[::4]:
        small = composite(renderer.render(orbit_camera(azimuth)), 255)
        image = cv2.copyMakeBorder(
            cv2.resize(small, (shorter, shorter), interpolation=cv2.INTER_CUBIC), 0, 0,
            0, size[0] - shorter, cv2.BORDER_REPLICATE)
        lens = CANONICAL_INTRINSICS.resized(shorter, shorter)
        wide = type(lens)(lens.fx, lens.fy, lens.cx, lens.cy, *size)
        views.append((image, orbit_camera(azimuth, intrinsics=wide)))
    return views


def _packed(kind: Any, image: Any) -> Any:
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    return kind(format='jpeg', data=cv2.imencode('.jpg', bgr)[1].tobytes())
