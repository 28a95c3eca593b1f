"""Image, camera info and pose, joined on stamps."""

from array import array
from itertools import permutations
import re

from active_recon.errors import MessageError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.rotations import pose_between
from msg_tools.images import image_to_msg
from msg_tools.joins import StampJoiner
from msg_tools.views import NOT_BEGUN, ViewJoiner
import numpy as np
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import Header

MS = 1_000_000
PIXELS = np.random.default_rng(0).integers(0, 256, (137, 137, 3), np.uint8)
IMAGE = image_to_msg(PIXELS, Header())


def pose(azimuth):
    return orbit_camera(azimuth).pose


def drain(joiner, now=0.0):
    return list(joiner.joined(now))


def only_error(joiner, now=0.0):
    error, = drain(joiner, now)
    assert isinstance(error, MessageError)
    return error


@pytest.mark.parametrize('order', list(permutations(range(3))))
def test_the_three_are_joined_in_any_order_of_arrival(order):
    joiner = ViewJoiner(max_pose_gap=0.1)
    arrivals = (lambda: joiner.add_image(5, IMAGE, 0.0),
                lambda: joiner.add_intrinsics(5, CANONICAL_INTRINSICS),
                lambda: joiner.add_pose(5, pose(1.0)))
    for index in order:
        assert not drain(joiner)
        arrivals[index]()
    view, = drain(joiner)
    assert (view.stamp, view.camera.azimuth) == (5, pytest.approx(1.0))
    assert not drain(joiner)


@pytest.mark.parametrize('fraction', [0.0, 0.25, 0.5, 1.0])
def test_a_pose_is_interpolated_along_the_way(fraction):
    joiner = ViewJoiner(max_pose_gap=0.1)
    joiner.add_pose(0, pose(1.0))
    joiner.add_image(round(100 * MS * fraction), IMAGE, 0.0)
    joiner.add_intrinsics(round(100 * MS * fraction), CANONICAL_INTRINSICS)
    joiner.add_pose(100 * MS, pose(1.1))
    view, = drain(joiner)
    assert view.camera.azimuth == pytest.approx(1.0 + 0.1 * fraction, abs=1e-4)


def test_interpolation_is_exact_at_its_ends_and_rigid_between():
    start, end = pose(0.3), pose(2.0)
    np.testing.assert_allclose(pose_between(start, end, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(pose_between(start, end, 1.0), end, atol=1e-12)
    rotation = pose_between(start, end, 0.4)[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_an_image_waits_for_its_later_pose_and_is_refused_when_none_can_come():
    joiner = ViewJoiner(max_pose_gap=0.05, patience=0.5)
    joiner.add_pose(0, pose(1.0))
    joiner.add_image(20 * MS, IMAGE, now=0.0)
    joiner.add_intrinsics(20 * MS, CANONICAL_INTRINSICS)
    assert not drain(joiner, now=0.4)
    error = only_error(joiner, now=0.6)
    assert error.kind == 'no_pose'
    assert 'within 0.05 s, the nearest is 0.020 s away' in str(error)


def test_an_image_waits_for_its_later_pose_also_after_one_that_was_stamped_far_ahead():
    joiner = ViewJoiner(max_pose_gap=0.05, patience=0.5)
    joiner.add_pose(3_600_000 * MS, pose(2.0))
    joiner.add_pose(0, pose(1.0))
    for stamp in range(20 * MS, 1000 * MS, 40 * MS):
        joiner.add_image(stamp, IMAGE, now=0.0)
        joiner.add_intrinsics(stamp, CANONICAL_INTRINSICS)
        assert not drain(joiner)
        joiner.add_pose(stamp + 20 * MS, pose(1.0))
        view, = drain(joiner)
        assert (view.stamp, view.camera.azimuth) == (stamp, pytest.approx(1.0))


def test_neighbours_that_are_too_far_apart_are_not_interpolated():
    joiner = ViewJoiner(max_pose_gap=0.05)
    joiner.add_pose(0, pose(1.0))
    joiner.add_image(20 * MS, IMAGE, 0.0)
    joiner.add_intrinsics(20 * MS, CANONICAL_INTRINSICS)
    joiner.add_pose(100 * MS, pose(1.1))
    error = only_error(joiner)
    assert error.kind == 'no_pose'
    assert str(error).endswith('the nearest is 0.020 s away, but that after the image 0.080 s')


def test_an_image_whose_poses_end_or_begin_beside_it_is_refused_with_the_side_that_lacks_one():
    for came, lacks in ((20, 'before'), (-20, 'after')):
        joiner = ViewJoiner(max_pose_gap=0.05, patience=0.5)
        joiner.add_pose((1000 + came) * MS, pose(1.0))
        joiner.add_image(1000 * MS, IMAGE, 0.0)
        joiner.add_intrinsics(1000 * MS, CANONICAL_INTRINSICS)
        assert str(only_error(joiner, now=1.0)).endswith(
            f'the nearest is 0.020 s away, but none came {lacks} the image')


def test_an_image_without_any_pose_is_refused_after_a_while():
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5)
    joiner.add_image(0, IMAGE, now=10.0)
    joiner.add_intrinsics(0, CANONICAL_INTRINSICS)
    assert 'none received' in str(only_error(joiner, now=11.0))


@pytest.mark.parametrize(('came', 'said'), [
    ([], 'none received'),
    ([0, 0], 'without a stamp: let .* fill in header.stamp'),
    ([5_000 * MS], r'the last is of 5.000 s; it must have the stamp of its image'),
    ([130_000 * MS], r'the last is of 130.000 s; it must have the stamp of its image')])
def test_camera_info_that_is_of_no_image_is_told_by_the_stamp_it_came_with(came, said):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5)
    joiner.clear(earliest=100_000 * MS)
    joiner.add_image(120_000 * MS, IMAGE, now=0.0)
    for stamp in came:
        joiner.add_intrinsics(stamp, CANONICAL_INTRINSICS)
    error = only_error(joiner, now=1.0)
    assert error.kind == 'no_camera_info'
    assert re.search(f"no camera info of the image's stamp, 120.000 s: .*{said}", str(error))


@pytest.mark.parametrize(('came', 'said'), [
    ([], 'none received'),
    ([0, 0], 'without a stamp: let .* fill in header.stamp'),
    ([5_000 * MS], 'the nearest is 115.000 s away; are .* stamped by the same clock'),
    ([130_000 * MS], 'the nearest is 10.000 s away; are .* stamped by the same clock'),
    ([119_800 * MS], 'the nearest is 0.200 s away$')])
def test_poses_that_are_of_no_image_are_told_by_the_stamps_they_came_with(came, said):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5)
    joiner.clear(earliest=100_000 * MS)
    joiner.add_image(120_000 * MS, IMAGE, now=0.0)
    joiner.add_intrinsics(120_000 * MS, CANONICAL_INTRINSICS)
    for stamp in came:
        joiner.add_pose(stamp, pose(1.0))
    error = only_error(joiner, now=1.0)
    assert error.kind == 'no_pose'
    assert re.search(f'expected one of its stamp, or .* within 0.1 s, .*{said}', str(error))


def test_a_first_stamp_of_0_where_the_time_begins_is_a_stamp():
    joiner = ViewJoiner(max_pose_gap=0.05, patience=0.5)
    joiner.add_image(30 * MS, IMAGE, now=0.0)
    joiner.add_intrinsics(0, CANONICAL_INTRINSICS)
    assert 'the last is of 0.000 s' in str(only_error(joiner, now=1.0))


def test_an_image_without_camera_info_is_refused_once_later_info_came():
    joiner = ViewJoiner(max_pose_gap=0.1)
    joiner.add_intrinsics(0, CANONICAL_INTRINSICS)
    joiner.add_image(1, IMAGE, 0.0)
    joiner.add_pose(1, pose(1.0))
    joiner.add_intrinsics(2, CANONICAL_INTRINSICS)
    assert only_error(joiner).kind == 'no_camera_info'


@pytest.mark.parametrize(('missing', 'kind'), [('pose', 'no_pose'),
                                               ('camera info', 'no_camera_info')])
def test_an_image_from_just_before_its_streams_begin_is_no_fault_of_theirs(missing, kind):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5)

    def send(stamp, whole=True):
        if whole or missing != 'camera info':
            joiner.add_intrinsics(stamp, CANONICAL_INTRINSICS)
        if whole or missing != 'pose':
            joiner.add_pose(stamp, pose(1.0))
        joiner.add_image(stamp, IMAGE, 0.0)

    send(499 * MS, whole=False)
    send(500 * MS, whole=False)
    send(1000 * MS)
    before, begun, view = drain(joiner)
    assert (before.kind, begun.kind, view.stamp) == (kind, NOT_BEGUN, 1000 * MS)
    send(1033 * MS, whole=False)
    send(1200 * MS)
    lost, view = drain(joiner)
    assert (lost.kind, view.stamp) == (kind, 1200 * MS)
    joiner.clear()
    send(1233 * MS, whole=False)
    send(1266 * MS)
    assert drain(joiner)[0].kind == NOT_BEGUN


@pytest.mark.parametrize('order', list(permutations(range(4))))
def test_with_masks_an_image_waits_for_its_own(order):
    joiner = ViewJoiner(max_pose_gap=0.1, masks=True)
    mask = Image(height=137)
    arrivals = (lambda: joiner.add_image(5, IMAGE, 0.0),
                lambda: joiner.add_intrinsics(5, CANONICAL_INTRINSICS),
                lambda: joiner.add_pose(5, pose(1.0)), lambda: joiner.add_mask(5, mask))
    for index in order:
        assert not drain(joiner)
        arrivals[index]()
    view, = drain(joiner)
    assert view.mask is mask


@pytest.mark.parametrize(('later', 'now'), [(True, 0.0), (False, 0.6)])
def test_an_image_whose_mask_can_no_longer_come_is_joined_without(later, now):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5, masks=True)
    joiner.add_image(0, IMAGE, 0.0)
    joiner.add_intrinsics(0, CANONICAL_INTRINSICS)
    joiner.add_pose(0, pose(1.0))
    if later:
        joiner.add_mask(1, Image())
    view, = drain(joiner, now)
    assert view.mask is None


def test_without_masks_none_is_waited_for():
    joiner = ViewJoiner(max_pose_gap=0.1)
    joiner.add_mask(0, Image())
    joiner.add_image(0, IMAGE, 0.0)
    joiner.add_intrinsics(0, CANONICAL_INTRINSICS)
    joiner.add_pose(0, pose(1.0))
    assert drain(joiner)[0].mask is None


def test_masks_and_depth_without_a_stamp_are_refused_but_at_the_beginning_of_time():
    joiner = ViewJoiner(max_pose_gap=0.1, masks=True, max_depth_gap=0.1)
    joiner.add_mask(0, Image())
    joiner.add_depth(0, Image())
    joiner.clear(earliest=5)
    with pytest.raises(MessageError, match='mask without a stamp: .* got 0; let') as raised:
        joiner.add_mask(0, Image())
    assert raised.value.kind == 'no_stamp'
    with pytest.raises(MessageError, match='depth image without a stamp'):
        joiner.add_depth(0, Image())


def test_camera_info_of_another_size_is_refused_and_the_next_view_is_joined():
    joiner = ViewJoiner(max_pose_gap=0.1)
    for stamp, lens in ((0, CANONICAL_INTRINSICS.resized(64, 48)), (1, CANONICAL_INTRINSICS)):
        joiner.add_image(stamp, IMAGE, 0.0)
        joiner.add_intrinsics(stamp, lens)
        joiner.add_pose(stamp, pose(1.0))
    error, view = drain(joiner)
    assert error.kind == 'camera_info'
    assert '137 x 137, got 64 x 48' in str(error)
    assert view.stamp == 1


def test_an_image_comes_once_and_in_order_until_an_episode_begins():
    joiner = ViewJoiner(max_pose_gap=0.1)
    joiner.add_image(5, IMAGE, 0.0)
    for stamp, kind in ((5, 'duplicate'), (4, 'out_of_order')):
        with pytest.raises(MessageError) as caught:
            joiner.add_image(stamp, IMAGE, 0.0)
        assert caught.value.kind == kind
    joiner.clear()
    joiner.add_image(4, IMAGE, 0.0)


@pytest.mark.parametrize('late', ['image', 'camera info', 'pose', 'mask'])
def test_what_is_late_of_the_last_episode_never_gets_into_a_view(late):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5, masks=True)
    joiner.add_intrinsics(90 * MS, CANONICAL_INTRINSICS)
    joiner.add_mask(90 * MS, Image())
    joiner.add_pose(90 * MS, pose(1.0))
    joiner.clear(earliest=100 * MS)
    if late == 'image':
        with pytest.raises(MessageError, match='expected increasing stamps'):
            joiner.add_image(90 * MS, IMAGE, 0.0)
        return
    joiner.add_image(100 * MS, IMAGE, 0.0)
    if late != 'camera info':
        joiner.add_intrinsics(100 * MS, CANONICAL_INTRINSICS)
    if late != 'mask':
        joiner.add_mask(100 * MS, Image())
    if late == 'pose':  # between two of them the image's would be interpolated
        joiner.add_pose(99 * MS, pose(1.0))
        joiner.add_pose(101 * MS, pose(1.1))
        assert only_error(joiner, 1.0).kind == NOT_BEGUN
        return
    joiner.add_pose(100 * MS, pose(1.0))
    joiner.add_intrinsics(99 * MS, CANONICAL_INTRINSICS)
    joiner.add_mask(99 * MS, Image())
    if late == 'mask':
        view, = drain(joiner, 1.0)
        assert view.mask is None
    else:
        assert only_error(joiner, 1.0).kind == 'no_camera_info'


def test_a_flood_of_images_without_poses_does_not_pile_up():
    joiner = ViewJoiner(max_pose_gap=0.1)
    refused = 0
    for stamp in range(200):
        joiner.add_image(stamp, IMAGE, 0.0)
        refused += len(drain(joiner))
    assert refused >= 150


def test_large_images_that_wait_hold_no_more_than_so_many_bytes():
    joiner = ViewJoiner(max_pose_gap=0.1)
    large = Image(encoding='mono8', height=8000, width=10_000, step=10_000,
                  data=array('B', bytes(80_000_000)))
    for stamp in range(6):
        joiner.add_image(stamp, large, 0.0)
    assert [error.kind for error in drain(joiner)] == ['no_camera_info'] * 3


def test_an_image_that_is_none_is_refused_where_it_comes_in_and_leaves_no_trace():
    joiner = ViewJoiner(max_pose_gap=0.1)
    with pytest.raises(MessageError) as caught:
        joiner.add_image(5, Image(encoding='yuv9'), 0.0)
    assert caught.value.kind == 'encoding'
    joiner.add_image(5, IMAGE, 0.0)


def test_an_image_is_decoded_when_it_is_first_asked_for():
    joiner = ViewJoiner(max_pose_gap=0.1)
    joiner.add_image(5, IMAGE, 0.0)
    joiner.add_intrinsics(5, CANONICAL_INTRINSICS)
    joiner.add_pose(5, pose(1.0))
    view, = drain(joiner)
    assert view.image_msg is IMAGE and 'image' not in vars(view)
    np.testing.assert_array_equal(view.image, PIXELS)
    assert view.image is view.image


def test_parts_of_a_stamp_are_complete_with_the_last_one():
    joiner = StampJoiner(('a', 'b'))
    assert joiner.add('a', 1, 'first') is None
    assert joiner.add('b', 2, 'other') is None
    assert joiner.add('b', 1, 'second') == {'a': 'first', 'b': 'second'}
    assert joiner.add('b', 1, 'again') is None


def test_parts_that_stay_incomplete_make_room():
    joiner = StampJoiner(('a', 'b'))
    for stamp in range(100):
        joiner.add('a', stamp, stamp)
    assert joiner.add('b', 0, 0) is None
    assert joiner.add('b', 99, 0) == {'a': 99, 'b': 0}


def test_parts_are_joined_after_their_stamps_went_back():
    joiner = StampJoiner(('a', 'b'))
    for stamp in range(1000, 1100):
        joiner.add('a', stamp, stamp)
    for stamp in range(3):
        assert joiner.add('a', stamp, stamp) is None
        assert joiner.add('b', stamp, 0) == {'a': stamp, 'b': 0}
