"""Cameras of the loop that measure the time from an image to the goal that follows from it."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
import math
import time
from typing import Any

from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, orbit_camera
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from benchmarks.core import OBJECTS
import numpy as np

_RATE = 36.0  # images a second
_VIEWS = 75  # of a run that shows views
_EPISODES = 2  # of a run that goes to goals
_GOALS = 20  # of an episode: after all views a policy has nowhere to go
_STEP = math.radians(30)  # from image to image, while the camera moves
_BUDGET_S = 120.0
_AGAIN_S = 2.0

GoalTimes = AbstractContextManager[Callable[[], float]]
"""Yields what makes a run and returns its median time from image to goal, milliseconds."""


@contextmanager
def showing_camera() -> Iterator[Callable[[], float]]:
    """Join the loop as a camera that shows it one view after the other, wherever the goal is."""
    with _joined() as (hear, publish, spin, ask):
        goals: dict[int, float] = {}
        hear('next_view', lambda stamp, _: goals.setdefault(stamp, time.perf_counter()))

        def show(azimuth: float) -> float:
            """Show a view, again if it gets lost (it is heard best effort); return the ms."""
            for _ in range(round(_BUDGET_S / _AGAIN_S)):
                known, start = len(goals), time.perf_counter()
                publish(azimuth)
                while time.perf_counter() - start < _AGAIN_S:
                    spin()
                    if len(goals) > known:
                        return 1e3 * (max(goals.values()) - start)
            raise TimeoutError(f'showed a view for {_BUDGET_S} s, but no goal came')

        def goal_ms() -> float:
            spent = []
            for turn in range(_VIEWS):
                if turn % _GOALS == 0:
                    ask('start_episode', _BUDGET_S, lambda: None)
                    due = time.perf_counter()
                spent.append(show(AZIMUTHS[turn % len(AZIMUTHS)]))
                due = max(due + 1 / _RATE, time.perf_counter())
                while time.perf_counter() < due:
                    spin()
            return float(np.median(spent))

        yield goal_ms


@contextmanager
def moving_camera() -> Iterator[Callable[[], float]]:
    """
    Join the loop as a camera in operation: it streams, and goes from goal to goal.

    With a step from image to image this makes four to five views a second.
    """
    with _joined() as (hear, publish, spin, ask):
        goals: dict[int, tuple[float, float]] = {}  # by stamp: when first heard, and where
        taken: list[int] = []
        hear('next_view', lambda stamp, azimuth: goals.setdefault(
            stamp, (time.perf_counter(), azimuth)))
        hear('view', lambda stamp, _: taken.append(stamp))
        sent: dict[int, float] = {}
        azimuth = 0.0

        def follow() -> None:
            """Stream images and go from goal to goal, for an episode."""
            nonlocal azimuth
            ask('start_episode', _BUDGET_S, lambda: None)
            known = len(goals)
            due = begun = time.perf_counter()
            while len(goals) - known < _GOALS:
                if time.perf_counter() - begun > _BUDGET_S:
                    raise TimeoutError(f'streamed images for {_BUDGET_S} s, but got '
                                       f'{len(goals) - known} goals, not {_GOALS}')
                goal = next(reversed(goals.values()))[1] if goals else 0.0
                away = azimuth_difference(goal, azimuth)
                azimuth += float(np.clip(away, -_STEP, _STEP))
                start = time.perf_counter()
                sent[publish(azimuth)] = start
                due = max(due + 1 / _RATE, time.perf_counter())
                while time.perf_counter() < due:
                    spin()

        def goal_ms() -> float:
            known_views = len(taken)
            for _ in range(_EPISODES):
                follow()
            heard = [at for at, _ in goals.values()]
            begins = [sent[stamp] for stamp in taken[known_views:] if stamp in sent]
            return 1e3 * float(np.median([
                min(at for at in heard if at > begin) - begin for begin in begins
                if begin < heard[-1]]))

        yield goal_ms


@contextmanager
def _joined() -> Iterator[tuple[Any, Any, Any, Any]]:
    """Yield what hears poses, what publishes an image from an azimuth, what spins, what asks."""
    from active_recon.launching.loop_client import joined_domain, LoopClient
    from active_recon.nodes.runtime.qos import LATCHED_QOS
    from geometry_msgs.msg import PoseStamped
    from msg_tools.cameras import camera_to_msgs
    from msg_tools.goals import view_goal_from_msg
    from msg_tools.images import image_to_msg
    from msg_tools.stamps import nanoseconds_from_stamp
    from sensor_msgs.msg import CameraInfo, Image
    from std_msgs.msg import Header

    with joined_domain('benchmark') as (node, executor):
        publishers = {kind: node.create_publisher(kind, f'camera/{topic}', 10) for kind, topic in (
            (CameraInfo, 'camera_info'), (PoseStamped, 'pose'), (Image, 'image_raw'))}
        renderer = Renderer(load_mesh(OBJECTS / 'chair.glb'))
        images = [composite(renderer.render(orbit_camera(azimuth)), 255) for azimuth in AZIMUTHS]
        noise = np.random.default_rng(0)

        def hear(topic: str, then: Callable[[int, float], object]) -> None:
            node.create_subscription(PoseStamped, topic, lambda msg: then(
                nanoseconds_from_stamp(msg.header.stamp),
                view_goal_from_msg(msg).azimuth), LATCHED_QOS)

        def publish(azimuth: float) -> int:
            header = Header(stamp=node.get_clock().now().to_msg(), frame_id='camera')
            image = images[np.abs(azimuth_difference(AZIMUTHS, azimuth)).argmin()]
            image = image & ~noise.integers(0, 2, image.shape, np.uint8)  # no two are the same
            for msg in (*camera_to_msgs(orbit_camera(azimuth), header),
                        image_to_msg(image, header)):
                publishers[type(msg)].publish(msg)
            return nanoseconds_from_stamp(header.stamp)

        yield (hear, publish, lambda: executor.spin_once(timeout_sec=0.001),
               LoopClient(node, executor).trigger)
