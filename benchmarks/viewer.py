"""What watching costs: the loop's time from image to goal, with the page and without it."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
import multiprocessing
from multiprocessing.sharedctypes import Synchronized
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time
from typing import Any

from active_recon.launching.processes import NodeProcesses, private_environment
from active_recon.viewer.address import free_port, is_served
from benchmarks.figures import Figure
from benchmarks.loop_cameras import GoalTimes, moving_camera, showing_camera
import msgspec
import viser
from websockets.sync.client import connect

_PAIRS = 6  # and one run to warm up
_RATE = 30.0  # updates a second that are to reach the page
_BUDGET_S = 120.0


def watching_figures() -> list[Figure]:
    """Measure a loop in operation, and one that is driven as fast as the page can change."""
    environment = private_environment()
    os.environ.update(environment)
    slowed, updates = _pairs(environment, {}, moving_camera)
    driven, driven_updates = _pairs(environment, {'take_views': 'all'}, showing_camera)
    name, page = 'image to goal, slower by a watched page', 'updates of the page'
    fast = ', 36 views a second'
    return [
        Figure(name, '%', slowed, 5), Figure(page, 'per s', updates, _RATE, more_is_better=True),
        Figure(name + fast, '%', driven, 5),
        Figure(page + fast, 'per s', driven_updates, _RATE, more_is_better=True)]


def _pairs(environment: Mapping[str, str], reconstructor: Mapping[str, Any],
           camera: Callable[[], GoalTimes]) -> tuple[list[float], list[float]]:
    """
    Alternate runs with and without a watched page; what is compared are the runs of a pair.

    The page is read by a process that draws nothing, since the browser that does may stand on
    another machine, or have a graphics card. Returns per cent and updates a second, by pair.
    """
    slowed, updates = [], []
    with TemporaryDirectory() as logs, NodeProcesses(Path(logs), environment) as nodes:
        nodes.start('reconstructor', reconstructor)
        nodes.start('view_planner', {'max_views': 1000, 'entropy_tolerance': 0.0})
        with camera() as goal_ms:
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
    return slowed, updates


@contextmanager
def _watched_page(environment: Mapping[str, str]) -> Iterator[Callable[[], int]]:
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
