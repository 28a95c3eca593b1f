"""`active-recon bag info`: what is in a bag, whether it can be replayed, what is missing."""

from active_recon.bags.storage.writer import BagWriter
from active_recon.cli.main import app
from active_recon.errors import DataError
from foreign_recordings import images, joints
from loop_bags import BEGIN, LoopRun, write_bag
import pytest
from typer.testing import CliRunner

pytestmark = pytest.mark.usefixtures('loaded_once')


def info(*arguments):
    result = CliRunner().invoke(app, ['bag', 'info', *map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run', LoopRun().messages)


def test_a_run_of_the_loop_tells_its_views_and_its_end(bag):
    told = info(bag)
    assert '/camera/image_raw' in told
    assert 'can be replayed, with the views that the loop took' in told
    assert '3 views at azimuths 0, 115, 229 degrees, done: max_views' in told
    assert 'not recorded' not in told


def test_one_view_is_told_as_one(tmp_path):
    told = info(write_bag(tmp_path / 'run', images() + joints()[:3]))
    assert '  episode 1: 1 view at azimuth 0 degrees\n' in told


def test_an_episode_that_ended_before_its_first_view_is_told(tmp_path):
    begun = LoopRun().messages[:2]  # that it began, and that nothing is done
    told = info(write_bag(tmp_path / 'run', begun + LoopRun('second', BEGIN + 10**10).messages))
    assert '  episode 1: no view\n' in told
    assert '  episode 2: 3 views at azimuths' in told


def test_what_was_not_recorded_is_named(tmp_path):
    partly = [entry for entry in LoopRun().messages if entry[1] not in ('/latent', '/entropy')]
    assert 'so not compared: entropy, latent' in info(write_bag(tmp_path / 'run', partly))


def test_what_was_lost_of_one_view_is_named_with_its_view(tmp_path):
    messages = LoopRun().messages
    lost = [entry for entry in messages if entry[1] == '/latent'][1]
    partly = [entry for entry in messages if entry is not lost]
    assert 'so not compared: the latent of view 2\n' in info(write_bag(tmp_path / 'run', partly))


def test_provenance_and_parameters_are_told(tmp_path):
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_provenance({'policy': 'random', 'seed': '3'})
        writer.attach_parameters('/view_planner', {'seed': 3})
    told = info(tmp_path / 'run')
    assert '  policy: random\n  seed: 3\n  parameters of view_planner\n' in told
    assert 'cannot be replayed: no messages: the bag is empty' in told


def test_what_is_missing_for_a_replay_is_told(tmp_path):
    folder = write_bag(tmp_path / 'run', images())
    assert 'cannot be replayed: no camera poses or azimuths on any topic' in info(folder)


def test_the_topics_of_other_peoples_bags_are_options(tmp_path):
    folder = write_bag(
        tmp_path / 'run', images() + images('/cam/depth') + joints(names=('lift', 'turn')))
    assert 'choose one with --image' in info(folder)
    told = info(folder, '--image', '/cam/depth', '--joint', 'turn', '--turned-object')
    assert 'with the views that its view gate accepts' in told
    assert '3 views at azimuths 0, 274, 188 degrees' in told


def test_images_that_cannot_become_views_are_told_with_the_reason(tmp_path):
    told = info(write_bag(tmp_path / 'run', images() + joints()[:6]))
    assert '2 views at azimuths 0, 86 degrees' in told
    assert '\n3 images were dropped: no camera pose arrived close enough to them' in told


def test_what_is_no_bag_is_refused(tmp_path):
    with pytest.raises(DataError, match='no bag there'):
        info(tmp_path / 'none')
