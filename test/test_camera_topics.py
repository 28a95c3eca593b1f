"""Which of a bag's topics are the camera's: by option, by the recorder's note, by name or type."""

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.topics import Topics
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import DataError
from foreign_recordings import AZIMUTHS, IMAGES, images, joints, png, TIMES
from loop_bags import DELAY, header, LoopRun, type_name, write_bag
from msg_tools.images import image_to_msg
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recorded_messages import definition
from sensor_msgs.msg import CompressedImage, Image


def of_encoding(encoding, pixels):
    def make(_image, stamp):
        return Image(header=stamp, encoding=encoding, height=pixels.shape[0],
                     width=pixels.shape[1], step=pixels[0].nbytes, data=pixels.tobytes())
    return make


def noted_bag(path, provenance, messages):
    """Write a bag with a recorder's note of what the nodes heard; return its path."""
    with BagWriter(path) as bag:
        bag.add_provenance(provenance)
        for time, topic, msg in sorted(messages, key=lambda entry: entry[0]):
            bag.add_topic(topic, type_name(msg), definition(type_name(msg)))
            bag.write(topic, serialize_message(msg), time + DELAY, time)
    return path


MASK = np.zeros((24, 32), np.uint8)
MASK[8:16, 8:16] = 255
mask, depth = of_encoding('mono8', MASK), of_encoding('16UC1', np.ones((24, 32), np.uint16))
grey = of_encoding('mono8', IMAGES[0][..., 0].copy())


def packed_depth(_image, stamp):
    return CompressedImage(header=stamp, format='16UC1; compressedDepth png', data=b'depth')


def views(folder, messages, **topics):
    run = read_run(write_bag(folder, sorted(messages, key=lambda entry: entry[0])),
                   Topics(**topics))
    (episode,) = run.episodes
    return episode.views


@pytest.mark.parametrize(('topic', 'make'), [
    ('/segmenter/out', mask), ('/segmenter/mask', mask), ('/wrist/depth', depth),
    ('/wrist/depth/compressedDepth', packed_depth)])
def test_masks_and_depth_are_never_taken_for_the_camera(tmp_path, topic, make):
    others = images(topic, make)
    found = views(tmp_path / 'run', images() + others + joints())
    assert [view.camera.azimuth for view in found] == pytest.approx(AZIMUTHS)
    assert np.array_equal(found[0].image, IMAGES[0])
    with pytest.raises(DataError, match=f'no camera images on any topic .{topic} has'):
        views(tmp_path / 'alone', others + joints())


def test_a_grey_camera_is_a_camera(tmp_path):
    found = views(tmp_path / 'run', images('/grey', grey) + images('/segmenter/out', mask)
                  + joints())
    assert np.array_equal(found[0].image[..., 1], IMAGES[0][..., 0])


def test_the_name_that_the_nodes_heard_decides_between_two_cameras(tmp_path):
    messages = images('/left/image') + images('/right/image', png) + joints()
    messages += images('/right/rectified')
    heard = {'camera/image_raw': '/right/rectified'}
    (episode,) = read_run(noted_bag(tmp_path / 'run', heard, messages)).episodes
    assert len(episode.views) == len(AZIMUTHS)


def test_what_the_nodes_heard_as_a_mask_is_no_camera(tmp_path):
    messages = images('/seen') + images('/soft') + joints()
    (episode,) = read_run(noted_bag(tmp_path / 'run', {'camera/mask': '/soft'}, messages)).episodes
    assert len(episode.views) == len(AZIMUTHS)


def test_the_camera_info_beside_the_images_is_theirs(tmp_path):
    from foreign_recordings import cameras

    lens = list(cameras())
    moved = [(time, '/cam/camera_info' if topic == '/info' else topic, msg)
             for time, topic, msg in lens]
    other = [(time, '/depth/camera_info', msg) for time, topic, msg in lens if topic == '/info']
    found = views(tmp_path / 'run', images() + moved + other)
    assert found[0].camera.distance == pytest.approx(3.0)


def test_all_that_is_missing_is_told_at_once(tmp_path):
    from std_msgs.msg import Header

    with pytest.raises(DataError, match='no camera images.*no camera poses'):
        read_run(write_bag(tmp_path / 'run', [(TIMES[0][0], '/said', Header())]))


def test_a_run_whose_camera_was_not_recorded_is_read_from_what_the_network_saw(tmp_path):
    loop = LoopRun()
    heard = [entry for entry in loop.messages if not entry[1].startswith('/camera/')]
    seen = [(stamp + 1, '/view_image', image_to_msg(loop.images[number], header(stamp, 'camera')))
            for number, stamp in enumerate(loop.stamps)]
    run = read_run(write_bag(tmp_path / 'run', sorted(heard + seen, key=lambda entry: entry[0])))
    (episode,) = run.episodes
    assert [view.camera.azimuth for view in episode.views] == pytest.approx([0.0, 2.0, 4.0])
    for view, image, grid in zip(episode.views, loop.images, loop.grids, strict=True):
        assert np.array_equal(view.image, image)
        assert np.allclose(view.reconstruction.occupancy[grid.occupancy > 0.02],
                           grid.occupancy[grid.occupancy > 0.02])
    assert not run.gaps.missing
    assert any('lens on /view_image' in each for each in run.assumed)
