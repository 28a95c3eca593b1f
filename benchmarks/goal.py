"""Image published to goal received: reconstructor and planner beside a camera, over DDS."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time
from typing import Any

from active_recon.geometry.cameras import Camera
from active_recon.launching.processes import NodeProcesses, private_environment
from benchmarks.figures import Figure
from benchmarks.memory import peak_mb
from benchmarks.stream import views_of_size

_EPISODES, _VIEWS = 12, 8  # of each episode
_PERIOD_S = 0.15
_BEGIN_S = 0.5
_BUDGET_S = 90.0
LOOP = {
    'reconstructor': {'take_views': 'all'},
    'view_planner': {'max_views': 1000, 'entropy_tolerance': 0.0}}
"""The nodes that are measured, and the parameters with which they take every image."""


def goal_figures() -> list[Figure]:
    """Send raw images of 640 x 480 pixels; time the occupancy and the goal of each."""
    figures = []
    for more, where in (({}, ''), ({'threads': 1}, ', threads: 1')):
        with loop_processes(**more) as nodes, _camera() as send:
            pids = [nodes.pid(node) for node in LOOP]
            figures += [*_measured(send, pids, where), memory_figure(pids, where)]
    return figures


def single_process_figures() -> list[Figure]:
    """Measure the same with both nodes in one process."""
    with loop_processes(single=True) as nodes, _camera() as send:
        pids, where = [nodes.pid('composed')], ', one process'
        return [*_measured(send, pids, where), memory_figure(pids, where)]


def memory_figure(pids: list[int], where: str) -> Figure:
    """Return the most that processes have held in memory, together."""
    return Figure(f'memory of reconstructor and planner, peak{where}', 'MB',
                  [sum(map(peak_mb, pids))], 500)


def _measured(send: Callable[[int], dict[str, list[float]]], pids: list[int],
              where: str) -> list[Figure]:
    """Return the figures of episodes, the first of which warms up, for nodes in processes."""
    send(1)
    before = cpu_seconds(pids)
    times = send(_EPISODES)
    spent = 1e3 * (cpu_seconds(pids) - before) / (_EPISODES * _VIEWS)
    goals = {('occupancy', 50): 6, ('occupancy', 95): 9, ('goal', 50): 8, ('goal', 95): 11}
    return [Figure(f'image published to {what} received{where}, 640 x 480, p{percent}', 'ms',
                   times[what], goal, percentile=percent)
            for (what, percent), goal in goals.items()] + [
        Figure(f'processor time of a view and its goal{where}', 'ms', [spent], 60)]


def cpu_seconds(pids: list[int]) -> float:
    """Return the processor time that processes have used so far, together."""
    ticks = 0
    for pid in pids:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
        ticks += int(fields[11]) + int(fields[12])  # utime and stime
    return ticks / os.sysconf('SC_CLK_TCK')


@contextmanager
def loop_processes(single: bool = False, **more: Any) -> Iterator[NodeProcesses]:
    """
    Start reconstructor and planner, each in a process or in one, in a domain of their own.

    Both have the parameters `more`, too.
    """
    loop = {node: {**parameters, **more} for node, parameters in LOOP.items()}
    environment = private_environment()
    os.environ.update(environment)
    with TemporaryDirectory() as logs, NodeProcesses(Path(logs), environment) as nodes:
        if single:
            file = Path(logs, 'loop.yaml')
            file.write_text(json.dumps({f'/**/{node}': {'ros__parameters': parameters}
                                        for node, parameters in loop.items()}))
            nodes.start('composed', {}, arguments=['--params-file', str(file)], names=list(LOOP))
        else:
            for node, parameters in loop.items():
                nodes.start(node, parameters)
        deadline = time.monotonic() + _BUDGET_S
        while ''.join(log.read_text() for log in Path(logs).glob('*.txt')).count(
                ']: ready') < len(LOOP):
            nodes.check()
            if time.monotonic() > deadline:
                raise TimeoutError(f'the nodes were not ready in {_BUDGET_S} s')
            time.sleep(0.01)
        yield nodes


@contextmanager
def _camera() -> Iterator[Callable[[int], dict[str, list[float]]]]:
    """Yield what shows episodes and returns the ms to the occupancy and the goal of each view."""
    from active_recon.launching.loop_client import joined_domain, LoopClient
    from active_recon.nodes.runtime.qos import LATCHED_QOS
    from geometry_msgs.msg import PoseStamped
    from msg_tools.cameras import camera_to_msgs
    from msg_tools.images import image_to_msg
    from msg_tools.stamps import nanoseconds_from_stamp
    from sensor_msgs.msg import CameraInfo, Image, PointCloud2
    from std_msgs.msg import Header

    with joined_domain('benchmark') as (node, executor):
        came: dict[str, dict[int, float]] = {'occupancy': {}, 'goal': {}}
        for kind, topic, what in ((PointCloud2, 'occupancy', 'occupancy'),
                                  (PoseStamped, 'next_view', 'goal')):
            node.create_subscription(kind, topic, lambda msg, what=what: came[what].setdefault(
                nanoseconds_from_stamp(msg.header.stamp), time.perf_counter()), LATCHED_QOS)
        publishers = {kind: node.create_publisher(kind, f'camera/{topic}', 10) for kind, topic in (
            (CameraInfo, 'camera_info'), (PoseStamped, 'pose'), (Image, 'image_raw'))}
        ask = LoopClient(node, executor).trigger
        views = views_of_size((640, 480))
        messages = [image_to_msg(image, Header()) for image, _ in views]

        def spin_until(condition: Callable[[], bool], budget: float, what: str = '') -> None:
            deadline = time.perf_counter() + budget
            while not condition() and (left := deadline - time.perf_counter()) > 0:
                executor.spin_once(timeout_sec=min(left, 0.05))
            if what and not condition():
                raise TimeoutError(f'waited {budget} s in vain for {what}')

        def begin(camera: Camera) -> None:
            """Begin an episode, and wait for its first goal, which needs the camera's pose."""
            ask('start_episode', _BUDGET_S, lambda: None)
            known, again = len(came['goal']), 0.0
            while len(came['goal']) == known:
                if time.perf_counter() > again:
                    header = Header(stamp=node.get_clock().now().to_msg(), frame_id='camera')
                    publishers[PoseStamped].publish(camera_to_msgs(camera, header)[1])
                    again = time.perf_counter() + _BEGIN_S
                executor.spin_once(timeout_sec=0.05)

        def send(episodes: int) -> dict[str, list[float]]:
            times: dict[str, list[float]] = {what: [] for what in came}
            for turn in range(episodes * _VIEWS):
                if turn % _VIEWS == 0:
                    begin(views[0][1])
                camera, msg = views[turn % len(views)][1], messages[turn % len(views)]
                msg.header = Header(stamp=node.get_clock().now().to_msg(), frame_id='camera')
                known = {what: len(each) for what, each in came.items()}
                parts = (*camera_to_msgs(camera, msg.header), msg)
                start = time.perf_counter()
                for part in parts:
                    publishers[type(part)].publish(part)
                spin_until(lambda known=known: all(
                    len(each) > known[what] for what, each in came.items()), _BUDGET_S, 'a goal')
                for what, each in came.items():
                    times[what].append(1e3 * (max(each.values()) - start))
                spin_until(lambda: False, start + _PERIOD_S - time.perf_counter())
            return times

        spin_until(lambda: (publishers[Image].get_subscription_count() > 0
                            and publishers[PoseStamped].get_subscription_count() > 1),
                   _BUDGET_S, 'the nodes')
        yield send
