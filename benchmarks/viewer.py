"""What watching costs: the loop's time from image to goal, with the page and without it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
import multiprocessing
from multiprocessing.sharedctypes import Synchronized
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from active_recon.cameras import AZIMUTHS, orbit_camera
from active_recon.demo.processes import NodeProcesses, private_environment
from active_recon.meshes import load_mesh
from active_recon.rendering import composite, Renderer
from active_recon.viewer.address import free_port, is_served
from benchmarks.core import OBJECTS
from benchmarks.figures import Figure
import msgspec
import numpy as np
import viser
from websockets.sync.client import connect

_PAIRS = 6  # and one run to warm up
_VIEWS = 75  # of a run; all of them together are one episode, of at most 1000
_RATE = 30.0  # updates a second that are to reach the page
_VIEW_RATE = 36.0  # views a second, each of which changes all that the page shows
_BUDGET_S = 120.0
_AGAIN_S = 2.0


def watching_figures() -> list[Figure]:
    """
    Alternate runs with and without a watched page; what is compared are the runs of a pair.

    The page is read by a process that draws nothing, since the browser that does may stand on
    another machine, or have a graphics card.
    """
    environment = private_environment()
    os.environ.update(environment)
    slowed, updates = [], []
    with TemporaryDirectory() as logs, NodeProcesses(Path(logs), environment) as nodes:
        nodes.start('reconstructor', {'take_views': 'all'})
        nodes.start('view_planner', {'max_views': 1000, 'entropy_tolerance': 0.0})
        with _camera() as goal_ms:
            goal_ms()  # warm
            for pair in range(_PAIRS):
                ms = {}
                for watched in (pair % 2 == 0, pair % 2 == 1):
                    with _watched_page(environment) if watched else nullcontext(int) as heard:
                        before, begin = heard(), time.monotonic()
                        ms[watched] = goal_ms()
                        if watched:
                            updates.append((heard() - before) / (time.monotonic() - begin))
                slowed.append(100 * (ms[True] / ms[False] - 1))
    return [
        Figure('image to goal, slower by a watched page', '%', slowed, 5),
        Figure('updates of the page', 'per s', updates, _RATE, more_is_better=True)]


@contextmanager
def _watched_page(environment: dict[str, str]) -> Iterator[Callable[[], int]]:
    """Start a viewer and read its page; yield what counts the updates that came."""
    port = free_port()
    spawn = multiprocessing.get_context('spawn')  # a ROS process must not be forked
    heard = spawn.Value('i', 0)
    with TemporaryDirectory() as logs, NodeProcesses(Path(logs), environment) as nodes:
        nodes.start('viewer', {'port': port})
        _wait(lambda: is_served(port), nodes, 'no page')
        reader = spawn.Process(target=_read_page, args=(port, heard), daemon=True)
        reader.start()
        try:
            _wait(lambda: heard.value > 0, nodes, 'nothing on the page')
            yield lambda: heard.value
        finally:
            reader.kill()
            reader.join()


def _wait(condition: Callable[[], bool], nodes: NodeProcesses, otherwise: str) -> None:
    deadline = time.monotonic() + _BUDGET_S
    while not condition():
        nodes.check()
        if time.monotonic() > deadline:
            raise TimeoutError(f'{otherwise} in {_BUDGET_S} s')
        time.sleep(0.02)


def _read_page(port: int, heard: 'Synchronized[int]') -> None:
    """Be the browser: read all that the page sends, and count it."""
    with connect(f'ws://127.0.0.1:{port}', subprotocols=[f'viser-v{viser.__version__}'],
                 compression=None, max_size=None) as socket:
        socket.send(msgspec.msgpack.encode({  # a browser is known from when it says this
            'type': 'ViewerCameraMessage', 'wxyz': (1, 0, 0, 0), 'position': (3, 0, 0),
            'fov': 1.0, 'near': 0.01, 'far': 100.0, 'image_height': 800, 'image_width': 1280,
            'look_at': (0, 0, 0), 'up_direction': (0, 0, 1)}))
        for _ in socket:
            heard.value += 1


@contextmanager
def _camera() -> Iterator[Callable[[], float]]:
    """Join the loop as its camera; yield what shows it views and returns the ms to a goal."""
    from active_recon.nodes.loop_watch import joined_domain
    from active_recon.nodes.qos import LATCHED
    from geometry_msgs.msg import PoseStamped
    from msg_tools.cameras import camera_to_msgs
    from msg_tools.images import image_to_msg
    from sensor_msgs.msg import CameraInfo, Image
    from std_msgs.msg import Header

    with joined_domain('benchmark') as (node, executor):
        goals: dict[int, float] = {}
        node.create_subscription(PoseStamped, 'next_view', lambda msg: goals.setdefault(
            msg.header.stamp.sec * 10**9 + msg.header.stamp.nanosec, time.perf_counter()), LATCHED)
        info_pub, pose_pub, image_pub = (node.create_publisher(kind, f'camera/{topic}', 10)
                                         for kind, topic in ((CameraInfo, 'camera_info'),
                                                             (PoseStamped, 'pose'),
                                                             (Image, 'image_raw')))
        renderer = Renderer(load_mesh(OBJECTS / 'chair.glb'))
        cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
        images = [composite(renderer.render(camera), 255) for camera in cameras]

        def spin(condition: Callable[[], bool], budget_s: float) -> bool:
            deadline = time.monotonic() + budget_s
            while not condition() and time.monotonic() < deadline:
                executor.spin_once(timeout_sec=0.001)
            return condition()

        def show(index: int) -> float:
            """Show a view, again if it gets lost (it is heard best effort); return the ms."""
            for _ in range(round(_BUDGET_S / _AGAIN_S)):
                header = Header(stamp=node.get_clock().now().to_msg(), frame_id='camera')
                info, pose = camera_to_msgs(cameras[index], header)
                image, known = image_to_msg(images[index], header), len(goals)
                start = time.perf_counter()
                for publisher, message in ((info_pub, info), (pose_pub, pose), (image_pub, image)):
                    publisher.publish(message)
                if spin(lambda known=known: len(goals) > known, _AGAIN_S):  # type: ignore[misc]
                    return 1e3 * (max(goals.values()) - start)
            raise TimeoutError(f'showed a view for {_BUDGET_S} s, but no goal came')

        def goal_ms() -> float:
            spent = []
            due = time.perf_counter()
            for turn in range(_VIEWS):
                spent.append(show(turn % len(cameras)))
                due = max(due + 1 / _VIEW_RATE, time.perf_counter())
                spin(lambda due=due: time.perf_counter() >= due, 1.0)  # type: ignore[misc]
            return float(np.median(spent))

        yield goal_ms
