"""The camera's node over real DDS: images and camera info, and a source that goes and returns."""

from active_recon.calibration.lens import write_lens
from active_recon.geometry.cameras import Intrinsics
from films import film, SIZE
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from msg_tools.cameras import intrinsics_from_msg
from msg_tools.images import image_from_msg
import pytest
from sensor_msgs.msg import CameraInfo, Image

pytestmark = pytest.mark.ros
LENS = Intrinsics(70.0, 71.0, 31.0, 25.0, *SIZE)


@pytest.fixture
def lens(tmp_path):
    write_lens(LENS, tmp_path / 'camera_info.yaml')
    return tmp_path / 'camera_info.yaml'


def test_images_and_camera_info_share_stamps_until_the_source_goes_and_when_it_returns(
        start_node, bench, tmp_path, lens):
    path = film(tmp_path / 'film.avi')
    images, infos = bench.subscribe(Image, 'camera/image_raw'), bench.subscribe(
        CameraInfo, 'camera/camera_info')
    start_node('camera', source=path, camera_info=lens, loop=True, camera_frame='lens')
    bench.until(lambda: len(images) > 10 and len(infos) > 10, 'images')
    assert image_from_msg(images[0]).shape == (SIZE[1], SIZE[0], 3)
    assert intrinsics_from_msg(infos[0]) == LENS
    assert images[0].header.frame_id == infos[0].header.frame_id == 'lens'
    stamps = [(msg.header.stamp.sec, msg.header.stamp.nanosec) for msg in infos]
    assert (images[5].header.stamp.sec, images[5].header.stamp.nanosec) in stamps
    path.rename(tmp_path / 'away.avi')  # as if it were unplugged
    bench.until(lambda: bench.counts('camera').get('warned/no_camera'), 'the warning')
    assert 'it is searched for every second' in bench.state('camera').problem
    before = len(images)
    (tmp_path / 'away.avi').rename(path)
    bench.until(lambda: len(images) > before + 5, 'images again')
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
    assert bench.ask(ChangeState, 'camera/change_state', request).success
    bench.within(0.5, lambda: False)
    before = len(images)
    bench.within(0.5, lambda: False)
    assert len(images) == before
    request.transition.id = Transition.TRANSITION_ACTIVATE
    assert bench.ask(ChangeState, 'camera/change_state', request).success
    bench.until(lambda: len(images) > before + 5, 'images after the node is active again')


def test_a_camera_that_was_deactivated_misses_no_source(start_node, bench, tmp_path):
    path = film(tmp_path / 'film.avi')
    start_node('camera', source=path, loop=True)
    path.rename(tmp_path / 'away.avi')
    bench.until(lambda: 'it is searched for' in bench.state('camera').problem, 'the warning')
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
    assert bench.ask(ChangeState, 'camera/change_state', request).success
    bench.until(lambda: not bench.state('camera').problem, 'the end of the warning')


def test_a_calibration_for_another_size_ends_the_node_with_one_line(start_node, tmp_path, lens):
    node = start_node('camera', ready=False, camera_info=lens,
                      source=film(tmp_path / 'film.avi', 2, size=(80, 60)))
    assert node.wait() == 1
    said, = node.log('FATAL')
    assert 'calibration for another size: expected 80 x 60 pixels' in said
    assert not node.log('Traceback')
