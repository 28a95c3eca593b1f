"""Real nodes as processes, on a private domain of this machine, and a bench that talks to them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
import fcntl
import os
from pathlib import Path
import re
import signal
import sys
import tempfile
import time
from typing import Any, IO

from active_recon.geometry.cameras import CANONICAL_ELEVATION, orbit_camera
from active_recon.nodes.runtime.shared_memory import PROFILE
from active_recon.quality.quality import Quality
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.cameras import camera_to_msgs, pose_to_msg, poses_to_msg
from msg_tools.diagnostics import diagnostics_from_msg, NodeStatus
from msg_tools.entropy import entropy_to_msg
from msg_tools.episodes import Episode, episode_to_msg
from msg_tools.images import image_to_msg, latent_to_msg
from msg_tools.quality import quality_to_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger
import trimesh

from .processes import Forked, Started

pytest.register_assert_rewrite('ros.hand_listed_loop')  # what differs is told

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM_QOS = QoSProfile(depth=100)
BUDGET_S = 60.0  # for what takes a second on an idle machine
SEND_AGAIN_S = 5.0
ANY_WEIGHTS = 'r2n2'  # which are ready at once, for tests in which it does not matter which
_ENTROPY = 100.0  # nats
_PIXELS = np.random.default_rng(0).integers(0, 256, (137, 137, 3), np.uint8)


class NodeProcess:
    """A node in a process of its own, its log in a file."""

    def __init__(self, name: str, parameters: dict[str, Any], folder: Path,
                 program: Sequence[str] = (), namespace: str = '') -> None:
        arguments = [f'{key}:={value}' for key, value in parameters.items()]
        options = ['--ros-args', '-r', f'__ns:=/{namespace}']
        for argument in arguments:
            options += ['-p', argument]
        folder.mkdir(parents=True, exist_ok=True)
        self._log_path = folder / f'{name}.log'
        self._log_path.touch()
        self._process: Forked | Started = (
            Started([sys.executable, *program, *options], folder, self._log_path) if program
            else Forked(name, options, folder, self._log_path))

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def running(self) -> bool:
        return self._process.wait(0) is None

    def log(self, pattern: str = '.') -> list[str]:
        """Return the log's lines in which the pattern is found."""
        return [line for line in self._log_path.read_text().splitlines()
                if re.search(pattern, line)]

    def wait_ready(self) -> None:
        """Wait until the node says that it is ready."""
        deadline = time.monotonic() + BUDGET_S
        while not self.log(r'\]: ready$'):
            code = self.wait(0.02)
            assert code is None, f'ended with {code} before it was ready: {self.log()}'
            assert time.monotonic() < deadline, f'not ready in {BUDGET_S} s: {self.log()}'

    def wait(self, timeout_s: float = BUDGET_S) -> int | None:
        """Return the exit code, None if it still runs after that time."""
        return self._process.wait(timeout_s)

    def ask_to_stop(self, how: signal.Signals = signal.SIGINT) -> None:
        """Send the signal, unless the node has ended."""
        if self.running:
            with suppress(ProcessLookupError):  # its end has not been reported yet
                os.kill(self.pid, how)

    def stop(self, how: signal.Signals = signal.SIGINT) -> int | None:
        """Ask the node to stop; return its exit code, None if it had to be killed."""
        self.ask_to_stop(how)
        code = self.wait()
        if code is None:
            os.kill(self.pid, signal.SIGKILL)
            self.wait()
        return code


class Bench:
    """The test's own node: it publishes, hears, calls, and waits for what it awaits."""

    def __init__(self) -> None:
        self.node = rclpy.create_node('bench')
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self._states: dict[str, NodeStatus] = {}
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        self._states |= diagnostics_from_msg(msg)

    def state(self, name: str) -> NodeStatus:
        """Return what a node told of itself last, nothing before the first time."""
        return self._states.get(f'/{name}', NodeStatus(f'/{name}'))

    def counts(self, name: str) -> Mapping[str, int]:
        """Return the counters that a node published last."""
        return self.state(name).counts

    def subscribe(self, kind: type, topic: str, qos: QoSProfile = STREAM_QOS) -> list[Any]:
        """Return a list that grows by what is heard."""
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    def advertise(self, kind: type, topic: str, qos: QoSProfile = STREAM_QOS) -> Any:
        """Return a publisher that somebody is about to hear."""
        publisher = self.node.create_publisher(kind, topic, qos)
        self.until(lambda: publisher.get_subscription_count() > 0, f'a listener on {topic}')
        return publisher

    def until(self, condition: Callable[[], Any], what: str, budget_s: float = BUDGET_S) -> Any:
        """Spin until the condition holds; return what it returned."""
        value = self.within(budget_s, condition)
        assert value, (f'waited {budget_s} s in vain for {what}; nodes: '
                       f'{sorted(self.node.get_fully_qualified_node_names())}; told last: '
                       f'{self._states}')
        return value

    def within(self, budget_s: float, condition: Callable[[], Any]) -> Any:
        """Spin until the condition holds or the time is over; return what it returned last."""
        deadline = time.monotonic() + budget_s
        while not (value := condition()) and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)
        return value

    def call(self, service: str) -> Trigger.Response:
        """Call a Trigger service and return its answer."""
        return self.ask(Trigger, service)

    def ask(self, kind: type, service: str, request: Any = None) -> Any:
        """Call a service of any kind and return its answer."""
        client = self.node.create_client(kind, service)
        self.until(client.service_is_ready, f'the service {service}')
        answers = []
        try:
            for _ in range(round(BUDGET_S / SEND_AGAIN_S)):
                # A request may go to the service of a node that has just ended, or before the
                # service knows where to answer
                answers.append(client.call_async(kind.Request() if request is None else request))
                if done := self.within(SEND_AGAIN_S, lambda: [
                        answer for answer in answers if answer.done()]):
                    return done[0].result()
        finally:
            self.node.destroy_client(client)
        raise AssertionError(f'no answer of {service}')

    def now(self) -> int:
        """Return the time in nanoseconds."""
        return self.node.get_clock().now().nanoseconds

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture(scope='session')
def ros_domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Return a domain that no other session uses, heard on this machine only."""
    domain, lock = _domain_of_its_own()
    patch = pytest.MonkeyPatch()
    patch.setenv('ROS_DOMAIN_ID', str(domain))
    patch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    patch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('ros_log')))
    patch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', str(PROFILE))
    patch.setenv('OMP_NUM_THREADS', '1')
    yield domain
    patch.undo()
    lock.close()


def _domain_of_its_own() -> tuple[int, IO[str]]:
    """Return a domain, and the file whose lock keeps other sessions of this machine out of it."""
    folder = Path(tempfile.gettempdir()) / 'active_recon_domains'
    folder.mkdir(exist_ok=True)
    for domain in range(1, 41):  # a demo that runs beside takes a higher one
        lock = (folder / str(domain)).open('w')
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
        else:
            return domain, lock
    raise AssertionError(f'expected a free ROS domain, but all in {folder} are locked')


@pytest.fixture(scope='session')
def ros(ros_domain: int) -> Iterator[None]:
    rclpy.init()
    yield
    rclpy.try_shutdown()


class FakeCamera:
    """A camera in the bench's hand, whose messages can be spoilt one by one."""

    def __init__(self, bench: Bench, qos: QoSProfile = STREAM_QOS) -> None:
        self._bench = bench
        self._publishers = [bench.advertise(kind, f'camera/{topic}', qos) for kind, topic in (
            (PoseStamped, 'pose'), (CameraInfo, 'camera_info'), (Image, 'image_raw'))]
        self.occupancy = bench.subscribe(PointCloud2, 'occupancy')
        bench.until(lambda: bench.node.count_publishers('occupancy'), 'a publisher of occupancy')

    def messages(self, stamp: int | None = None, azimuth: float = 0.5,
                 elevation: float = CANONICAL_ELEVATION
                 ) -> tuple[Image, CameraInfo, PoseStamped]:
        """Return a good view, of now if no stamp in nanoseconds is given."""
        at = stamp_from_nanoseconds(self._bench.now() if stamp is None else stamp)
        header = Header(stamp=at, frame_id='camera')
        info, pose = camera_to_msgs(orbit_camera(azimuth, elevation), header)
        return image_to_msg(_PIXELS, header), info, pose

    def send(self, image: Image | None = None, info: CameraInfo | None = None,
             pose: PoseStamped | None = None) -> None:
        for publisher, msg in zip(self._publishers, (pose, info, image), strict=True):
            if msg is not None:
                publisher.publish(msg)

    def show(self) -> int:
        """Send a good view and wait for its occupancy; return its stamp."""
        stamps = []

        def heard() -> list[int]:
            return [nanoseconds_from_stamp(msg.header.stamp) for msg in self.occupancy
                    if nanoseconds_from_stamp(msg.header.stamp) in stamps]

        for _ in range(round(BUDGET_S / SEND_AGAIN_S)):  # best effort may lose one
            messages = self.messages()
            stamps.append(nanoseconds_from_stamp(messages[0].header.stamp))
            self.send(*messages)
            if found := self._bench.within(SEND_AGAIN_S, heard):
                return found[-1]
        raise AssertionError('no occupancy after a good view')


class FakeReconstructor:
    """A reconstructor in the bench's hand; it begins to publish when it is made."""

    TOPICS = {'episode': Header, 'latent': Image, 'view': PoseStamped, 'views': PoseArray,
              'entropy': JointState, 'quality': DiagnosticArray}
    PARTS = ('entropy', 'latent', 'view')

    def __init__(self, bench: Bench, topics: Sequence[str] = ('episode', *PARTS),
                 heard: bool = True) -> None:
        self.bench = bench
        self.goals = bench.subscribe(PoseStamped, 'next_view', LATCHED_QOS)
        self.done = bench.subscribe(Header, 'done', LATCHED_QOS)
        self._publishers: dict[str, Any] = {}
        for topic in topics:
            self.publish_on(topic, heard)

    def publish_on(self, topic: str, heard: bool = True) -> None:
        """Offer a topic; `heard` waits for a listener."""
        make = self.bench.advertise if heard else self.bench.node.create_publisher
        self._publishers[topic] = make(self.TOPICS[topic], topic, LATCHED_QOS)

    def begin(self, name: str, stamp: int | None = None) -> None:
        """Begin an episode, now if no stamp in nanoseconds is given."""
        begin = self.bench.now() if stamp is None else stamp
        self._publishers['episode'].publish(episode_to_msg(Episode(name, begin)))

    def show(self, latent: np.ndarray, azimuth: float, stamp: int | None = None,
             parts: Sequence[str] = PARTS, elevation: float = CANONICAL_ELEVATION,
             quality: Quality | None = None, weights: str = '',
             earlier: Sequence[float] = (), object_size: float | None = None) -> int:
        """Publish a view's parts, `views` with those at earlier azimuths; return their stamp."""
        stamp = self.bench.now() if stamp is None else stamp
        header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id='object')
        messages = {'entropy': entropy_to_msg(_ENTROPY, header),
                    'latent': latent_to_msg(latent, header),
                    'view': pose_to_msg(orbit_camera(azimuth, elevation).pose, header),
                    'views': poses_to_msg([orbit_camera(each, elevation).pose
                                           for each in (*earlier, azimuth)], header)}
        if quality is not None:
            messages['quality'] = quality_to_msg(quality, header, weights, object_size)
        for part in parts:
            self._publishers[part].publish(messages[part])
        return stamp

    def show_entropy(self, entropy: float) -> None:
        """Publish an entropy in nats, or what is none, of now."""
        header = Header(stamp=stamp_from_nanoseconds(self.bench.now()), frame_id='object')
        self._publishers['entropy'].publish(entropy_to_msg(entropy, header))

    def wait_goal(self, after: int) -> PoseStamped:
        """Wait for the goal that was asked for after a time in nanoseconds."""
        return self.bench.until(
            lambda: next((msg for msg in reversed(self.goals)
                          if nanoseconds_from_stamp(msg.header.stamp) > after), None), 'a goal')


def _started(folder: Path) -> Iterator[Callable[..., NodeProcess]]:
    processes: list[NodeProcess] = []

    def start(name: str, ready: bool = True, program: Sequence[str] = (), namespace: str = '',
              **parameters: Any) -> NodeProcess:
        process = NodeProcess(name, parameters, folder / str(len(processes)), program, namespace)
        processes.append(process)
        if ready:
            process.wait_ready()
        return process

    yield start
    for process in processes:
        process.ask_to_stop()
    for process in processes:
        process.stop()


@pytest.fixture
def start_node(ros_domain: int, tmp_path: Path) -> Iterator[Callable[..., NodeProcess]]:
    """Start a node by its name, for one test; `ready=False` does not wait for it."""
    yield from _started(tmp_path)


@pytest.fixture(scope='module')
def start_shared_node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory
                      ) -> Iterator[Callable[..., NodeProcess]]:
    """Start a node by its name, for all tests of a module."""
    yield from _started(tmp_path_factory.mktemp('nodes'))


@pytest.fixture(scope='session')
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the smallest mesh that can be shown."""
    path = tmp_path_factory.mktemp('mesh') / 'box.ply'
    trimesh.creation.box((1, 0.6, 0.4)).export(path)
    return path


@pytest.fixture
def bench(ros: None) -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.close()


@pytest.fixture(scope='module')
def shared_bench(ros: None) -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.close()
