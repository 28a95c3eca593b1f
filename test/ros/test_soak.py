"""Hours in minutes: many episodes of one loop, its memory flat and every episode whole."""

from functools import partial
from pathlib import Path

from conftest import LATCHED
from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from std_msgs.msg import Header

pytestmark = [pytest.mark.ros, pytest.mark.slow]
EPISODES, WARM_UP = 60, 15
VIEWS = 5
GROWTH_MB = 8.0


def memory_mb(process):
    """Return what a node holds in memory now."""
    status = Path(f'/proc/{process.pid}/status').read_text()
    return int(status.split('VmRSS:')[1].split()[0]) / 1e3


def test_sixty_episodes_end_whole_and_leave_memory_flat(bench, start_node, box, tmp_path):
    start = {
        'recorder': partial(start_node, output_dir=tmp_path),
        'turntable_camera': partial(start_node, mesh=box, rate=30.0, time_scale=20.0),
        'reconstructor': partial(start_node, take_views='at_goal', output_dir=tmp_path),
        'view_planner': partial(start_node, max_views=VIEWS, entropy_tolerance=0.0)}
    done = bench.hear(Header, 'done', LATCHED)
    episodes = bench.hear(Header, 'episode', LATCHED)
    nodes = {name: begin(name) for name, begin in start.items()}
    before = {}
    for number in range(EPISODES):
        answer = bench.call('start_episode')
        assert answer.success
        bench.until(lambda name=answer.message: episodes and episodes[-1].frame_id == name,
                    f'episode {number}')
        begin = nanoseconds_from_stamp(episodes[-1].stamp)
        bench.until(lambda begin=begin: any(
            end.frame_id and nanoseconds_from_stamp(end.stamp) > begin for end in done),
            f'the end of episode {number}')
        if number + 1 == WARM_UP:
            before = {name: memory_mb(node) for name, node in nodes.items()}
    grown = {name: memory_mb(node) - before[name] for name, node in nodes.items()}
    assert all(growth < GROWTH_MB for growth in grown.values()), grown
    assert all(node.running for node in nodes.values())
    bench.until(lambda: bench.counts('reconstructor').get('views', 0) >= EPISODES * VIEWS,
                'the count of all views')
