"""The demo itself: from the command to the bag, the mesh and the picture, and when it is cut."""

import math
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from active_recon import __version__
from active_recon.bags.replay.comparison import SAME_BITS
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.bags.storage.opening import open_bag
from active_recon.models.weights_files import find_weights
from active_recon.objects import find_object
from active_recon.runtimes import load_runtime
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.point_grids import grid_from_points
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import cv2
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from safetensors import safe_open
from safetensors.numpy import load_file, save_file
import trimesh

pytestmark = pytest.mark.ros
ROOT = Path(__file__).parents[2]
BUDGET_S = 300.0  # for what takes ten seconds on an idle machine
VIEWS = 3
NODES = ('recorder', 'turntable_camera', 'view_planner', 'reconstructor')


class DemoProcess:
    """The demo in a process of its own."""

    def __init__(self, folder, *options):
        self.bags = folder / 'bags'
        command = [sys.executable, '-m', 'active_recon.cli.main', 'demo',
                   '--output-dir', str(self.bags), *options]
        self._process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, 'PYTHONPATH': str(ROOT), 'OMP_NUM_THREADS': '1',
                 'COLUMNS': '120', 'PYTHONUNBUFFERED': '1', 'TMPDIR': str(folder)})

    def until(self, condition, what):
        deadline = time.monotonic() + BUDGET_S
        while not (value := condition()):
            assert time.monotonic() < deadline, f'waited {BUDGET_S} s in vain for {what}'
            if self._process.poll() is not None:
                pytest.fail(f'ended before {what}: {self.end()}')
            time.sleep(0.01)
        return value

    def interrupt(self, how=signal.SIGINT):
        self._process.send_signal(how)

    def end(self):
        """Wait for the end; return the exit code and what was said."""
        out, err = self._process.communicate(timeout=BUDGET_S)
        return self._process.returncode, out, err

    def nodes(self):
        """Return the process ids of the nodes by their names, orphans too."""
        found = {}
        for folder in Path('/proc').glob('[0-9]*'):
            try:
                name = (folder / 'comm').read_text().strip()  # 15 characters at most
                ours = f'TMPDIR={self.bags.parent}' in (folder / 'environ').read_text()
            except OSError:  # it has ended meanwhile
                continue
            if ours:
                found |= {node: int(folder.name) for node in NODES if node[:15] == name}
        return found

    def recording(self):
        """Return the bag's file, None before it is there."""
        return next(self.bags.glob('*/*.mcap'), None)


@pytest.fixture
def start_demo(tmp_path):
    demos = []

    def start(*options):
        demos.append(DemoProcess(tmp_path, *options))
        return demos[-1]

    yield start
    for demo in demos:
        demo.interrupt()
        demo.end()


@pytest.fixture(scope='module')
def finished(tmp_path_factory):
    """One whole run: its folder, and what it said."""
    demo = DemoProcess(tmp_path_factory.mktemp('demo'), '--views', str(VIEWS))
    code, out, err = demo.end()
    assert code == 0, out + err
    (folder,) = demo.bags.iterdir()
    return folder, out


@pytest.fixture(scope='module')
def messages(finished):
    """What the bag holds: each topic's messages."""
    folder, _ = finished
    topics = {}
    with AnyReader([folder]) as reader:
        for connection, _, data in reader.messages():
            topics.setdefault(connection.topic, []).append(
                reader.deserialize(data, connection.msgtype))
    return topics


def rows(out):
    """Return view, azimuth, entropy, expected and least IoU, IoU and ms as the table has them."""
    cells = [re.findall(r'[\d.]+', line) for line in out.splitlines() if line.startswith('│')]
    return [tuple(map(float, row)) for row in cells]


def stamp(msg):
    return msg.header.stamp.sec * 1_000_000_000 + msg.header.stamp.nanosec


def test_demo_leaves_a_bag_a_mesh_and_a_picture(finished):
    folder, out = finished
    assert {path.name for path in folder.iterdir()} == {
        f'{folder.name}_0.mcap', 'metadata.yaml', 'chair.ply', 'run.png'}
    assert len(trimesh.load(folder / 'chair.ply').faces) > 0
    assert min(cv2.imread(str(folder / 'run.png')).shape[:2]) > 500
    assert str(folder) in out.replace('\n', '')


def test_demo_tells_of_each_view_what_the_bag_holds(finished, messages):
    told = rows(finished[1])
    resolution = load_runtime().spec.resolution
    truth = voxelise(load_mesh(find_object('chair')), resolution).occupied(0.5)
    assert [row[0] for row in told] == list(range(1, VIEWS + 1))
    for row, view, occupancy, judged in zip(
            told, *(messages[topic] for topic in ('/view', '/occupancy', '/quality')),
            strict=True):
        position = view.pose.position
        azimuth = math.degrees(math.atan2(position.y, position.x)) % 360
        points = np.frombuffer(occupancy.data.tobytes(), np.float32).reshape(-1, 4)
        assert stamp(view) == stamp(occupancy) == stamp(judged)
        quality = {pair.key: pair.value for pair in judged.status[0].values}
        assert row[3:5] == pytest.approx(
            (float(quality['expected_iou']), float(quality['lower_bound'])), abs=6e-3)
        assert abs((row[1] - azimuth + 180) % 360 - 180) <= 0.51
        assert row[5] == pytest.approx(
            iou(grid_from_points(points).occupied(0), truth), abs=6e-4)
        assert 0 < row[6] < 60_000


def test_every_view_is_an_image_that_the_camera_took(messages):
    images = {stamp(image) for image in messages['/camera/image_raw']}
    assert {stamp(view) for view in messages['/view']} <= images


def test_the_whole_loop_is_in_the_bag(messages):
    assert {'/camera/image_raw', '/camera/camera_info', '/camera/pose', '/view', '/occupancy',
            '/probabilities', '/latent', '/entropy', '/quality', '/episode',
            '/next_view', '/next_azimuth', '/azimuth_scores', '/goal_reason', '/done',
            '/diagnostics'} == set(messages)
    assert messages['/done'][-1].frame_id == 'max_views'
    chosen = sorted({stamp(goal) for goal in messages['/next_view']})[1:]
    assert [stamp(reason) for reason in messages['/goal_reason']] == chosen
    refused = {value.key for msg in messages['/diagnostics'] for status in msg.status
               for value in status.values if value.key.startswith('refused')}
    assert not refused


def test_the_bag_replays_to_the_same_bits_on_the_machine_that_made_it(finished):
    folder, _ = finished
    run = read_run(folder)
    settings = recorded_setup(run)
    verified = verify(run, settings.load_reconstructor(), settings.load_planner())
    assert verified.knows_policy
    assert {found.verdict for found in verified.comparison.deviations.values()} == {SAME_BITS}


def test_the_bag_says_what_made_it(finished):
    summary = open_bag(finished[0]).summary()
    assert summary.provenance == {
        'version': __version__, 'object': 'chair.glb', 'policy': 'attention', 'seed': '0',
        'needs_front': 'false', **load_runtime(threads=2).provenance}
    assert {name: parameters['use_sim_time']
            for name, parameters in summary.parameters.items()} == dict.fromkeys(
        ('recorder', 'turntable_camera', 'reconstructor', 'view_planner'), False)
    assert summary.parameters['view_planner']['max_views'] == VIEWS


def test_mcap_ros2_decodes_every_message(finished, messages):
    folder, _ = finished
    with (folder / f'{folder.name}_0.mcap').open('rb') as stream:
        decoded = list(make_reader(
            stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    assert len(decoded) == sum(map(len, messages.values()))


def nothing_yet(demo):
    return True


def a_recorder(demo):
    return demo.recording()


def a_streaming_camera(demo):
    return demo.recording() and demo.recording().stat().st_size > 20_000


@pytest.mark.slow
@pytest.mark.parametrize(('moment', 'how'), [
    (nothing_yet, signal.SIGTERM), (a_recorder, signal.SIGINT),
    (a_streaming_camera, signal.SIGINT), (a_streaming_camera, signal.SIGTERM)])
def test_interrupted_demo_ends_its_nodes_and_closes_the_bag(start_demo, moment, how):
    demo = start_demo('--policy', 'farthest', '--views', '24')
    demo.until(lambda: demo.nodes(), 'the first node')
    demo.until(lambda: moment(demo), moment.__name__)
    demo.interrupt(how)
    code, out, err = demo.end()
    assert code == 130, out + err
    assert 'Traceback' not in err
    assert not demo.nodes()
    for folder in demo.bags.glob('*'):
        with AnyReader([folder]) as reader:
            assert reader.message_count == len(list(reader.messages()))


def test_a_node_that_dies_is_told_with_its_last_words(start_demo):
    demo = start_demo('--policy', 'farthest', '--views', '24')
    nodes = demo.until(lambda: len(found := demo.nodes()) == 4 and found, 'the four nodes')
    demo.until(lambda: a_streaming_camera(demo), 'the camera')
    os.kill(nodes['turntable_camera'], signal.SIGKILL)
    code, _, err = demo.end()
    assert code == 2
    assert 'turntable_camera ended with code -9 (killed: was there enough memory?). The' in err
    assert '[turntable_camera]: ready' in err
    assert 'Traceback' not in err
    assert not demo.nodes()


@pytest.mark.slow
def test_a_reconstructor_that_cannot_be_configured_is_told_with_its_last_words(
        start_demo, tmp_path):
    tensors = load_file(find_weights('lifting'))
    with safe_open(find_weights('lifting'), 'numpy') as weights:
        metadata = weights.metadata()
    tensors.popitem()
    save_file(tensors, tmp_path / 'mine.safetensors', metadata)
    demo = start_demo('--model', str(tmp_path / 'mine.safetensors'))
    code, _, err = demo.end()
    assert code == 2
    assert 'reconstructor ended with code 1. The end of its log' in err
    assert 'its tensors do not fit its config' in err
    assert 'Traceback' not in err
    assert not demo.nodes()


@pytest.mark.parametrize(('name', 'said'), [
    ('teapot', 'teapot: no such mesh file, and none of bed, car, chair, sofa, table'),
    pytest.param(__file__, 'no mesh that can be read', marks=pytest.mark.slow),
])
def test_what_is_no_object_is_refused_in_one_line(start_demo, name, said):
    code, out, err = start_demo('--object', name).end()
    assert (code, out) == (2, '')
    assert said in err
    assert 'Traceback' not in err


def test_help_needs_neither_ros_nor_torch():
    code = ('import sys, active_recon.cli.main; '
            'sys.exit(bool({"torch", "rclpy", "cv2", "trimesh"} & set(sys.modules)))')
    assert subprocess.run([sys.executable, '-c', code], timeout=BUDGET_S,
                          env={**os.environ, 'PYTHONPATH': str(ROOT)}).returncode == 0
