"""The loop under limits of motion and on a dome, over real DDS, and its bag, which replays so."""

from active_recon.acquisition.motion import MotionLimits
from active_recon.bags.replay.comparison import SAME_BITS, WITHIN_TOLERANCE
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.geometry.view_distance import view_distance
import pytest
from std_msgs.msg import Header

from .conftest import LATCHED_QOS

pytestmark = pytest.mark.ros
LIMITS = {'azimuth_range': [-1.0, 2.0], 'forbidden_sectors': [0.4, 0.9]}
DOME = {'elevation_range': [-0.2, 1.1], 'azimuth_speed': 0.7, 'elevation_speed': 0.4,
        'view_time': 0.5, 'motion_cost': 0.01}


def recorded_loop(start_node, bench, folder, camera, planner):
    """Run the loop for four views and return what its bag holds."""
    recorder = start_node('recorder', output_dir=folder)
    done = bench.subscribe(Header, 'done', LATCHED_QOS)
    start_node('turntable_camera', start_azimuth=3.3, time_scale=20.0, rate=20.0, **camera)
    start_node('reconstructor', take_views='at_goal', settle_time=0.2)
    start_node('view_planner', max_views=4, entropy_tolerance=0.0, **planner)
    bench.until(lambda: done and done[-1].frame_id == 'max_views', 'the end of the loop')
    (bag,) = folder.iterdir()
    (path,) = bag.glob('*.mcap')
    recorded = bench.counts('recorder').get('messages', 0)

    def is_told():
        """Whether the parameters are in the bag, and the recorder is well past the last view."""
        names = [f'parameters/{node}.yaml'.encode() for node in ('reconstructor', 'view_planner')]
        return (bench.counts('recorder').get('messages', 0) > recorded + 100
                and all(name in path.read_bytes() for name in names))

    bench.until(is_told, 'the parameters in the bag')
    recorder.stop()
    return read_run(bag)


def check_replay(run, settings):
    """Check that the run replays to what was recorded of it, and with which parameters."""
    setup = recorded_setup(run)
    for name, value in settings.items():
        recorded = setup.planner[name]
        assert (list(recorded) if isinstance(value, list) else recorded) == value
    found = verify(run, setup.load_reconstructor(), setup.load_planner())
    assert found.comparison.verdict in (SAME_BITS, WITHIN_TOLERANCE)
    assert found.comparison.deviations['goal'].compared == 3


def goals_of(run):
    episode = run.episodes[-1]
    goals = [episode.first_goal, *(view.goal for view in episode.views if view.goal)]
    assert len(goals) == 4
    return [goal.camera for goal in goals]


def test_a_loop_keeps_to_its_limits_and_its_bag_replays_under_them(
        start_node, bench, box, tmp_path):
    settings = {'policy': 'random', 'motion_weight': 0.5, **LIMITS}
    run = recorded_loop(start_node, bench, tmp_path / 'bags', {'mesh': box}, settings)
    limits = MotionLimits(**LIMITS)
    assert all(limits.allows(goal.azimuth) for goal in goals_of(run))
    check_replay(run, settings)


@pytest.mark.slow
def test_a_loop_on_a_dome_takes_views_at_several_elevations_and_its_bag_replays_so(
        start_node, bench, box, tmp_path):
    settings = {'policy': 'uniform', **DOME}
    run = recorded_loop(start_node, bench, tmp_path / 'bags', {'mesh': box, 'follows': 'view'},
                        settings)
    goals = goals_of(run)
    assert len({round(goal.elevation, 2) for goal in goals}) >= 3
    assert all(-0.21 < goal.elevation < 1.11 for goal in goals)
    for view, goal in zip(run.episodes[-1].views, goals, strict=True):
        assert view_distance(view.camera, goal) < 0.14
    check_replay(run, settings)
