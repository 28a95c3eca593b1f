"""The loop under limits of motion, over real DDS, and its bag, which replays under the same."""

from active_recon.acquisition.motion import MotionLimits
from active_recon.bags.replay.comparison import SAME_BITS, WITHIN_TOLERANCE
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
import pytest
from std_msgs.msg import Header

from .conftest import LATCHED_QOS

pytestmark = pytest.mark.ros
LIMITS = {'azimuth_range': [-1.0, 2.0], 'forbidden_sectors': [0.4, 0.9]}


def test_a_loop_keeps_to_its_limits_and_its_bag_replays_under_them(
        start_node, bench, box, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags')
    done = bench.subscribe(Header, 'done', LATCHED_QOS)
    start_node('turntable_camera', mesh=box, start_azimuth=3.3, time_scale=20.0, rate=20.0)
    start_node('reconstructor', take_views='at_goal', settle_time=0.2)
    start_node('view_planner', policy='random', max_views=4, entropy_tolerance=0.0,
               motion_weight=0.5, **LIMITS)
    bench.until(lambda: done and done[-1].frame_id == 'max_views', 'the end of the loop')
    (folder,) = (tmp_path / 'bags').iterdir()

    (path,) = folder.glob('*.mcap')
    recorded = bench.counts('recorder').get('messages', 0)

    def is_told():
        """Whether the parameters are in the bag, and the recorder is well past the last view."""
        names = [f'parameters/{node}.yaml'.encode() for node in ('reconstructor', 'view_planner')]
        return (bench.counts('recorder').get('messages', 0) > recorded + 100
                and all(name in path.read_bytes() for name in names))

    bench.until(is_told, 'the parameters in the bag')
    recorder.stop()
    run = read_run(folder)
    episode = run.episodes[-1]
    goals = [episode.first_goal, *(view.goal for view in episode.views if view.goal)]
    assert len(goals) == 4
    limits = MotionLimits(**LIMITS)
    assert all(limits.allows(goal.camera.azimuth) for goal in goals)
    settings = recorded_setup(run)
    assert {name: list(settings.planner[name]) for name in LIMITS} == LIMITS
    assert settings.planner['motion_weight'] == 0.5
    found = verify(run, settings.load_reconstructor(), settings.load_planner())
    assert found.comparison.verdict in (SAME_BITS, WITHIN_TOLERANCE)
    assert found.comparison.deviations['goal'].compared == 3
