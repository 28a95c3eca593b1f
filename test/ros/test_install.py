"""Both installs, by pip and by colcon: the index finds them, and every executable publishes."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from PIL import Image as Picture
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Header
import trimesh

pytestmark = pytest.mark.ros

ROOT = Path(__file__).parents[2]
COLCON = Path(sys.prefix, 'colcon')  # where `make test` puts it
NODES = {'camera', 'reconstructor', 'recorder', 'turntable_camera', 'view_planner', 'viewer'}
PUBLISHED = {f'/diagnostics of /{node}' for node in NODES} | {'/episode', '/camera/image_raw'}
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
START_BUDGET_S, STOP_BUDGET_S = 180.0, 60.0  # of a second or two on an idle machine


@dataclass(frozen=True)
class Install:
    prefix: Path
    environment: dict[str, str]

    @property
    def executables(self) -> Path:
        return self.prefix / 'lib/active_recon'


@pytest.fixture(scope='module')
def source(tmp_path_factory) -> Path:
    """Copy the working tree as a clone would have it: without what git ignores."""
    listed = subprocess.run(
        ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
        cwd=ROOT, check=True, capture_output=True, text=True).stdout.split('\0')
    folder = tmp_path_factory.mktemp('source') / 'active_recon'
    for name in filter(None, listed):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder


@pytest.fixture(scope='module', params=['pip', 'colcon'])
def install(request, source, tmp_path_factory) -> Install:
    build = {'pip': pip_install, 'colcon': colcon_build}[request.param]
    return build(source, tmp_path_factory.mktemp(request.param))


def pip_install(source: Path, folder: Path) -> Install:
    # Into a prefix of its own: the copy in the environment of these tests stays as it is.
    run([sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-index',
         '--no-build-isolation', '--ignore-installed', '--prefix', folder, source])
    modules = next(folder.glob('**/active_recon/__init__.py')).parents[1]
    return Install(folder, {
        **os.environ, 'PYTHONPATH': str(modules), 'AMENT_PREFIX_PATH': str(folder)})


def colcon_build(source: Path, folder: Path) -> Install:
    assert COLCON.is_dir(), f'expected colcon in {COLCON}, found none: run `make test`'
    environment = {**os.environ, 'PYTHONPATH': str(COLCON), 'COLCON_HOME': str(folder),
                   'PATH': f'{Path(sys.executable).parent}:{os.environ["PATH"]}'}
    run([COLCON / 'bin/colcon', '--log-base', folder / 'log', 'build', '--base-paths', source,
         '--build-base', folder / 'build', '--install-base', folder / 'install'],
        env=environment, cwd=folder)
    del environment['PYTHONPATH']
    sourced = run(['bash', '-c', 'source install/setup.bash && env -0'],
                  env=environment, cwd=folder).split('\0')
    return Install(folder / 'install/active_recon',
                   dict(line.split('=', 1) for line in sourced if line))


def run(command: list[str | Path], **options) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)
    assert done.returncode == 0, f'{command} failed:\n{done.stdout}\n{done.stderr}'
    return done.stdout


@pytest.mark.parametrize('install', [
    pytest.param('pip', marks=pytest.mark.slow), 'colcon'], indirect=True)
def test_ament_index_finds_the_package(install, tmp_path):
    found = run([sys.executable, '-c', 'from ament_index_python import get_package_prefix; '
                 'print(get_package_prefix("active_recon"))'],
                env=install.environment, cwd=tmp_path)
    assert Path(found.strip()) == install.prefix


def test_executables_are_the_nodes_alone_and_composed_and_the_command(install):
    assert {path.name for path in install.executables.iterdir()} == NODES | {
        'active-recon', 'composed'}
    assert all(os.access(path, os.X_OK) for path in install.executables.iterdir())


def test_modules_and_their_data_come_from_the_install(install, source, tmp_path):
    found = run([sys.executable, '-c', 'import active_recon, msg_tools; '
                 'print(active_recon.__path__[0], msg_tools.__path__[0])'],
                env=install.environment, cwd=tmp_path).split()
    assert all(Path(path).is_relative_to(install.prefix) for path in found)
    for folder in ('weights', 'objects', 'nodes'):
        shipped = {path.name for path in (source / 'active_recon' / folder).glob('*.*')}
        assert shipped <= {path.name for path in Path(found[0], folder).iterdir()}


@pytest.mark.parametrize('install', [
    pytest.param('pip', marks=pytest.mark.slow), 'colcon'], indirect=True)
def test_every_executable_publishes_and_ends_when_asked(
        install, ros_domain, tmp_path, monkeypatch):
    mesh = tmp_path / 'box.ply'
    trimesh.creation.box().export(mesh)
    Picture.new('RGB', (64, 48)).save(tmp_path / 'image.png')
    parameters = {'camera': f'source:={tmp_path}', 'turntable_camera': f'mesh:={mesh}',
                  'recorder': f'output_dir:={tmp_path}/bags',
                  'reconstructor': f'output_dir:={tmp_path}'}
    private = {'ROS_DOMAIN_ID': str(ros_domain),
               'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_LOG_DIR': str(tmp_path)}
    for name, value in private.items():
        monkeypatch.setenv(name, value)
    commands = {node: [install.executables / node] for node in NODES}
    for node, parameter in parameters.items():
        commands[node] += ['--ros-args', '-p', parameter]
    with (listener() as heard,
          started(commands, install.environment | private, tmp_path) as processes):
        deadline = time.monotonic() + START_BUDGET_S
        while not heard() >= PUBLISHED:
            for node, process in processes.items():
                assert process.poll() is None, said(tmp_path, node)
            assert time.monotonic() < deadline, f'not heard: {PUBLISHED - heard()}'
        for node, process in processes.items():
            process.send_signal(signal.SIGINT)
            assert process.wait(STOP_BUDGET_S) == 0, said(tmp_path, node)


@pytest.mark.slow
def test_the_installed_demo_leaves_a_bag_a_mesh_and_a_picture(install, tmp_path):
    run([install.executables / 'active-recon', 'demo', '--views', '2', '--policy', 'farthest'],
        env=install.environment, cwd=tmp_path)
    folder, = (tmp_path / 'bags').iterdir()
    left = {path.suffix for path in folder.iterdir()}
    assert left == {'.mcap', '.yaml', '.ply', '.png'}


@contextmanager
def started(commands: dict[str, list], environment: dict[str, str],
            folder: Path) -> Iterator[dict[str, subprocess.Popen]]:
    processes = {}
    try:
        for node, command in commands.items():
            with open(folder / f'{node}.txt', 'w') as log:
                processes[node] = subprocess.Popen(
                    command, env=environment, cwd=folder, stdout=log, stderr=log)
        yield processes
    finally:
        for process in processes.values():
            process.kill()
            process.wait()


def said(folder: Path, node: str) -> str:
    return f'{node} said:\n{(folder / node).with_suffix(".txt").read_text()}'


@contextmanager
def listener() -> Iterator[Callable[[], set[str]]]:
    """Give a function that listens for a moment and returns what has been heard so far."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node('listener', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    heard = set()
    node.create_subscription(Header, '/episode', lambda _: heard.add('/episode'), LATCHED_QOS)
    node.create_subscription(
        Image, '/camera/image_raw', lambda _: heard.add('/camera/image_raw'), 1)
    node.create_subscription(DiagnosticArray, '/diagnostics', lambda msg: heard.update(
        f'/diagnostics of {status.name}' for status in msg.status), 10)

    def listen() -> set[str]:
        executor.spin_once(timeout_sec=0.2)
        return heard

    try:
        yield listen
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
