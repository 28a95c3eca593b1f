"""A network and a policy of a dozen lines run the loop over real DDS, and their bag replays."""

from pathlib import Path
import signal

from active_recon.bags.replay.verification import verify
from active_recon.bags.replay.what_if import run_with_overrides
from active_recon.bags.runs.loop_setup import Overrides, recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.models.registry import NETWORKS
from active_recon.models.weights import Bundle, save_weights
from active_recon.policies import POLICIES
import numpy as np
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import Header
import toy

from .conftest import LATCHED_QOS

pytestmark = pytest.mark.ros
TOY = (str(Path(toy.__file__)),)
VIEWS = 3


@pytest.fixture
def registered(monkeypatch):
    monkeypatch.setitem(NETWORKS, 'toy', toy.ENTRY)
    monkeypatch.setitem(POLICIES, 'opposite', toy.POLICY)


@pytest.fixture
def weights(tmp_path):
    path = tmp_path / 'toy.safetensors'
    config = toy.ToyConfig()
    save_weights(path, Bundle(toy.Toy(config.gain), None, config, 0.3, model='toy'))
    return path


@pytest.mark.slow
def test_toys_run_the_loop_and_their_bag_replays_to_the_same_bits(
        start_node, bench, box, weights, registered, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags')
    start_node('turntable_camera', mesh=box, rate=30.0, time_scale=20.0, background=255.0)
    start_node('reconstructor', program=(*TOY, 'reconstructor'), weights=weights,
               take_views='at_goal', object_yaw=1.0)
    start_node('view_planner', program=(*TOY, 'view_planner'), policy='opposite',
               max_views=VIEWS, entropy_tolerance=0.0)
    done = bench.subscribe(Header, 'done', LATCHED_QOS)
    latents = bench.subscribe(Image, 'latent', LATCHED_QOS)
    bench.until(lambda: done and done[-1].frame_id, 'the end of the episode')
    bench.until(lambda: len(latents) >= VIEWS, 'all latents')
    assert bench.call('stop').success
    recorder.stop(signal.SIGINT)
    bag, = (path.parent for path in (tmp_path / 'bags').glob('*/metadata.yaml'))
    run = read_run(bag)
    episode, = (each for each in run.episodes if each.views)
    assert len(episode.views) == VIEWS
    first, second = (view.camera.direction for view in episode.views[:2])
    assert first[:2] @ second[:2] < 0  # on the other side
    settings = recorded_setup(run)
    found = verify(run, settings.load_reconstructor(), settings.load_planner())
    assert found.comparison.verdict == 'same bits'
    assert found.comparison.deviations['goal'].compared == VIEWS - 1
    other = run_with_overrides(run, settings, Overrides(policy='opposite', threshold=0.6))
    grids = [each.views[-1].occupied.occupancy > 0
             for each in (run.episodes[-1], other.episodes[-1])]
    assert 0 < np.count_nonzero(grids[1]) < np.count_nonzero(grids[0])
