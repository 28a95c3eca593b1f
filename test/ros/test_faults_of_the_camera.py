"""
The loop of turntable, reconstructor and planner under each fault of the camera, over real DDS.

Which views are to be taken stands here by hand; what they have to give is computed from their
images without ROS.
"""

from functools import partial
import logging
import time

from active_recon.models.weights_files import PAPER_MODEL
from active_recon.parameters.shared import NetworkParameters
from active_recon.simulation.faults import FAULTS
from active_recon.simulation.shown_object import rendered_object
import pytest
import torch
import trimesh

from .hand_listed_loop import computed, DEGREES, Loop, RECOVERED_S

pytestmark = pytest.mark.ros
LOG = logging.getLogger(__name__)
RATE = 40.0

# What each fault is told as: while the loop goes on, and where nothing gets through at all
SOME = {'drop_images:0.3': 'warned/missing_images', 'delay_images:0.2': 'warned/late_images',
        'duplicate_images:0.3': 'refused/duplicate', 'reorder_images:0.3': 'refused/out_of_order',
        'corrupt_images:0.8': 'refused/image_bytes',
        'wrong_camera_info:0.3': 'refused/camera_info',
        'drop_camera_info:0.3': 'refused/no_camera_info', 'drop_poses:0.3': 'warned/missing_poses'}
ALL = {'drop_images:1': 'warned/silent_images',
       'drop_camera_info:1': 'warned/silent_camera_info', 'drop_poses:1': 'warned/silent_poses',
       'pose_noise:0.05': 'warned/noisy_poses', 'stall_motor:1': 'warned/stalled',
       'restart:1': 'warned/silent_camera'}
TOGETHER = ['drop_images:0.1', 'delay_images:0.05', 'duplicate_images:0.1', 'reorder_images:0.1',
            'corrupt_images:0.1', 'wrong_camera_info:0.1', 'drop_camera_info:0.1',
            'pose_noise:0.001', 'drop_poses:0.1', 'stall_motor:0.2', 'restart:0.1']


@pytest.fixture(scope='module')
def mesh(tmp_path_factory):
    """Return a thing that looks different from everywhere."""
    path = tmp_path_factory.mktemp('mesh') / 'thing.ply'
    boxes = [((1, 0.3, 0.3), (0, 0, 0)), ((0.2, 0.5, 0.2), (0.4, 0.2, 0.1)),
             ((0.2, 0.2, 0.6), (-0.2, 0.1, 0.2))]
    trimesh.util.concatenate([
        trimesh.creation.box(extents, trimesh.transformations.translation_matrix(place))
        for extents, place in boxes]).export(path)
    return path


@pytest.fixture(scope='module')
def shown(mesh):
    return rendered_object(mesh)


@pytest.fixture(scope='module')
def as_many_threads_as_the_node():
    threads = torch.get_num_threads()
    torch.set_num_threads(NetworkParameters().threads)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope='module')
def expected(as_many_threads_as_the_node, shown):
    return computed(shown, DEGREES)


@pytest.fixture(scope='module')
def start(start_shared_node, mesh, tmp_path_factory):
    """Return what starts each node of the loop, by its name."""
    return {
        'turntable_camera': partial(start_shared_node, 'turntable_camera', mesh=mesh, rate=RATE,
                                    time_scale=50.0),
        'reconstructor': partial(start_shared_node, 'reconstructor', take_views='at_goal',
                                 weights=PAPER_MODEL,
                                 output_dir=tmp_path_factory.mktemp('meshes')),
        'view_planner': partial(start_shared_node, 'view_planner', policy='uniform',
                                max_views=len(DEGREES), entropy_tolerance=0.0, start_azimuth=0.0)}


@pytest.fixture(scope='module')
def nodes(start):
    nodes = {name: begin(ready=False) for name, begin in start.items()}
    for node in nodes.values():
        node.wait_ready()
    return nodes


@pytest.fixture(scope='module')
def shared_loop(shared_bench, nodes, shown):
    return Loop(shared_bench, nodes, shown)


@pytest.fixture
def loop(shared_loop):
    assert shared_loop.set_faults().successful
    yield shared_loop
    shared_loop.set_faults()


EPISODES = [1, pytest.param(10, marks=pytest.mark.slow)]


@pytest.mark.parametrize('episodes', EPISODES)
@pytest.mark.parametrize('fault', [
    name if name in ('drop_images', 'stall_motor') else
    pytest.param(name, marks=pytest.mark.slow) for name in FAULTS])
def test_a_fault_is_told_and_when_it_is_over_the_loop_goes_on_with_the_right_views(
        loop, expected, fault, episodes):
    for _ in range(episodes):
        loop.begin()
        loop.wait_views(1)
        for entry, key in [*SOME.items(), *ALL.items()]:
            if entry.startswith(f'{fault}:'):
                go_through(loop, entry, key)
        loop.check(DEGREES, expected)


def go_through(loop, entry, key):
    """Have a fault until it is told, and for six views if any can be taken; then go on."""
    before, began = loop.count(key), time.monotonic()
    assert loop.set_faults(entry).successful
    loop.wait_told(key, before)
    told_s = time.monotonic() - began
    if entry in SOME:
        loop.wait_views(len(loop.taken) + 6)
    taken, ended = len(loop.taken), time.monotonic()
    assert loop.set_faults().successful
    loop.wait_views(taken + 1, RECOVERED_S)
    LOG.info('%s: told after %.2f s, the next view %.2f s after its end',
             entry, told_s, time.monotonic() - ended)


@pytest.mark.slow  # one fault after the other is in every run
@pytest.mark.parametrize('episodes', [1, 10])
def test_all_faults_together_change_neither_the_views_nor_what_comes_of_them(
        loop, expected, episodes):
    assert loop.set_faults(*TOGETHER).successful
    for _ in range(episodes):
        loop.begin()
        loop.check(DEGREES, expected)
    assert loop.set_faults().successful
    loop.bench.until(lambda: not loop.bench.state('reconstructor').problem, 'the end of warnings')


def test_faults_that_cannot_be_are_refused_with_a_reason_and_the_old_ones_stay(loop):
    assert loop.set_faults('drop_camera_info:1').successful
    refused = loop.set_faults('drop_pictures:0.3')
    assert not refused.successful
    assert 'a name of drop_images' in refused.reason
    loop.wait_told('refused/no_camera_info', loop.count('refused/no_camera_info'))


@pytest.fixture
def stopped(loop):
    """Return the loop in mid-episode, the motor standing away from its goal."""
    loop.begin()
    loop.wait_views(4)
    before = loop.count('warned/stalled')
    assert loop.set_faults('stall_motor:1').successful
    loop.wait_told('warned/stalled', before)
    return loop


def test_a_reconstructor_that_is_killed_comes_back_to_a_clean_episode(stopped, start, expected):
    episode = stopped.episode
    stopped.kill('reconstructor')
    stopped.nodes['reconstructor'] = start['reconstructor']()
    stopped.bench.until(lambda: stopped.episode != episode, 'a new episode')
    stopped.wait_told('warned/stalled', 0)
    assert not stopped.taken
    assert stopped.set_faults().successful
    stopped.check(DEGREES, expected)


def test_a_planner_that_is_killed_comes_back_and_asks_for_the_views_that_are_left(
        stopped, start, expected):
    goal = stopped.goal
    stopped.kill('view_planner')
    stopped.nodes['view_planner'] = start['view_planner']()
    stopped.bench.until(lambda: stopped.goal != goal, 'a goal of the new planner')
    assert stopped.set_faults().successful
    stopped.check(DEGREES, expected)


def test_a_camera_that_is_killed_comes_back_and_hears_the_open_goal_again(
        stopped, start, expected):
    stopped.kill('turntable_camera')
    stopped.nodes['turntable_camera'] = start['turntable_camera']()
    stopped.check(DEGREES, expected)
