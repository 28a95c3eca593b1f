"""Depth in messages, beside photos and in bags: the same metres everywhere."""

from array import array
from dataclasses import replace
import math
import struct

from active_recon.bags.runs import run_writing
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun, RecordedView
from active_recon.bags.runs.run_writing import write_run
from active_recon.errors import DataError, MessageError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.photos.camera_file import posed_photos
from active_recon.photos.depth_files import depth_files, read_depth
from active_recon.photos.files import open_photos, photo_paths
from active_recon.photos.readers import read_cameras
from active_recon.photos.views import load_views
from active_recon.volumes.depth_images import DepthImage
import cv2
from msg_tools.compressed_depth import depth_to_compressed_msg, metres_from_msg
from msg_tools.images import depth_from_msg, depth_to_msg, image_to_msg
from msg_tools.loop import depth_to_msgs
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.views import ViewJoiner
import numpy as np
from photo_rigs import blank_photos, PINHOLE, rig, transforms, write_transforms
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

MS = 1_000_000
METRES = np.random.default_rng(0).uniform(0.2, 3, (4, 6)).astype(np.float32)
IMAGE = image_to_msg(np.zeros((137, 137, 3), np.uint8), Header())


def in_millimetres(metres, order='<', encoding='16UC1'):
    values = np.rint(metres * 1000).astype(f'{order}u2')
    height, width = metres.shape
    return Image(height=height, width=width, encoding=encoding, step=2 * width,
                 is_bigendian=order == '>', data=array('B', values.tobytes()))


def test_depth_comes_back_as_it_was_also_where_there_is_none():
    metres = METRES.copy()
    metres[0, :3] = math.nan, math.inf, 0
    msg = depth_to_msg(metres, Header(frame_id='camera'))
    assert (msg.encoding, msg.header.frame_id) == ('32FC1', 'camera')
    np.testing.assert_array_equal(depth_from_msg(msg), metres)


@pytest.mark.parametrize('encoding', ['16UC1', 'mono16'])
@pytest.mark.parametrize('order', ['<', '>'])
def test_sixteen_bits_are_millimetres_in_either_order_of_bytes(order, encoding):
    np.testing.assert_allclose(depth_from_msg(in_millimetres(METRES, order, encoding)), METRES,
                               atol=0.0005 + 1e-6)


@pytest.mark.parametrize(('change', 'said'), [
    ({'encoding': 'rgb8'}, 'unknown depth encoding: expected 16UC1, mono16, 32FC1'),
    ({'data': array('B', [0] * 7)}, 'image data too short'), ({'width': 0}, 'empty image')])
def test_other_messages_are_no_depth(change, said):
    msg = in_millimetres(METRES)
    for name, value in change.items():
        setattr(msg, name, value)
    with pytest.raises(MessageError, match=said):
        depth_from_msg(msg)


def joined(depths, now=0.0, gap=0.02, stamp=100 * MS):
    joiner = ViewJoiner(max_pose_gap=0.1, patience=0.5, max_depth_gap=gap)
    for at, msg in depths:
        joiner.add_depth(at * MS, msg)
    joiner.add_image(stamp, IMAGE, 0.0)
    joiner.add_intrinsics(stamp, CANONICAL_INTRINSICS)
    joiner.add_pose(stamp, orbit_camera(1.0).pose)
    return list(joiner.joined(now))


def test_the_nearest_depth_image_goes_with_an_image():
    early, near, late = (Image(height=number) for number in range(3))
    view, = joined([(85, early), (95, near), (115, late)])
    assert view.depth is near
    view, = joined([(100, near)])
    assert view.depth is near


def test_an_image_waits_for_depth_that_may_still_come_and_then_goes_without():
    assert not joined([(85, Image())])
    view, = joined([(85, Image(height=3))], now=0.6)
    assert view.depth.height == 3
    for depths in ([(70, Image()), (130, Image())], []):
        view, = joined(depths, now=0.6)
        assert view.depth is None


def test_without_a_gap_no_depth_is_waited_for():
    view, = joined([], gap=None)
    assert view.depth is None


def write_depth(path, metres, kind=np.uint16):
    path.parent.mkdir(parents=True, exist_ok=True)
    stored = np.rint(metres * 1000).astype(kind) if kind == np.uint16 else metres.astype(kind)
    assert cv2.imwrite(str(path), stored)


PHOTO_DEPTH = np.random.default_rng(0).uniform(0.5, 2, (240, 320)).astype(np.float32)


def test_depth_beside_photos_and_in_its_folder_is_found_and_is_no_photo(tmp_path):
    photos = [tmp_path / name for name in ('a.jpg', 'b.jpg', 'c.jpg', 'd_depth.jpg')]
    for path in photos:
        path.write_bytes(b'')
    write_depth(tmp_path / 'a_depth.png', PHOTO_DEPTH)
    write_depth(tmp_path / 'depth/B.png', PHOTO_DEPTH)
    assert depth_files(photos) == {photos[0]: tmp_path / 'a_depth.png',
                                   photos[1]: tmp_path / 'depth/B.png'}
    assert photo_paths(tmp_path) == photos


def test_depth_files_are_millimetres_or_metres_at_the_size_of_the_photo(tmp_path):
    path = tmp_path / 'a_depth.png'
    write_depth(path, PHOTO_DEPTH)
    np.testing.assert_allclose(read_depth(path, 320, 240), PHOTO_DEPTH, atol=0.00051)
    np.testing.assert_array_equal(read_depth(path, 640, 480)[::2, ::2], read_depth(path, 320, 240))
    spoilt = PHOTO_DEPTH.copy()
    spoilt[0, :2] = math.nan, math.inf
    write_depth(tmp_path / 'b.tiff', spoilt, np.float32)
    found = read_depth(tmp_path / 'b.tiff', 320, 240)
    np.testing.assert_array_equal(found[1:], PHOTO_DEPTH[1:])
    assert not found[0, :2].any()
    write_depth(tmp_path / 'c.tiff', spoilt, np.float64)
    np.testing.assert_array_equal(read_depth(tmp_path / 'c.tiff', 320, 240), found)


def test_depth_finer_than_its_photo_is_that_in_the_middle_of_each_pixel(tmp_path):
    across = (np.arange(320, dtype=np.float32) + 0.5) / 320
    write_depth(tmp_path / 'a.tiff', np.tile(1 + across, (240, 1)), np.float32)
    found = read_depth(tmp_path / 'a.tiff', 64, 48)
    np.testing.assert_allclose(found[0], 1 + (np.arange(64) + 0.5) / 64, atol=1e-6)


def test_depth_of_another_shape_or_kind_is_refused(tmp_path):
    path = tmp_path / 'a_depth.png'
    write_depth(path, PHOTO_DEPTH)
    with pytest.raises(DataError, match='another size: expected 300 x 300 pixels'):
        read_depth(path, 300, 300)
    cv2.imwrite(str(path), np.zeros((240, 320, 3), np.uint8))
    with pytest.raises(DataError, match='no depth image: expected one channel of 16 bits'):
        read_depth(path, 320, 240)
    path.write_text('no image')
    with pytest.raises(DataError, match='got no image'):
        read_depth(path, 320, 240)
    with pytest.raises(DataError, match='depths/a.png: no depth image: .* found none'):
        read_depth(tmp_path / 'depths/a.png', 320, 240)


def test_a_frame_of_transforms_names_its_depth_and_a_bad_one_leaves_its_photo(tmp_path):
    cameras = rig(PINHOLE)
    blank_photos(tmp_path, cameras)
    content = transforms(cameras)
    content['frames'][1]['depth_file_path'] = 'measured/one.png'
    content['frames'][2]['depth_file_path'] = 'measured/missing.png'
    write_depth(tmp_path / 'measured/one.png', PHOTO_DEPTH)
    write_transforms(tmp_path / 'transforms.json', cameras)
    import json
    (tmp_path / 'transforms.json').write_text(json.dumps(content))
    photos, _ = open_photos(photo_paths(tmp_path))
    posed, _ = posed_photos(read_cameras(tmp_path / 'transforms.json', photos), photos)
    views, left_out = load_views(posed)
    assert not left_out
    assert [view.depth is not None for view in views] == [False, True, False, False]
    assert 'missing.png: no depth image' in views[2].depth_refusal
    np.testing.assert_allclose(views[1].depth, PHOTO_DEPTH, atol=0.00051)


SECOND = 1_000_000_000


def run_with_depth(folder, depths, use_depth=True):
    views = [RecordedView(SECOND * (number + 2), np.full((137, 137, 3), 200, np.uint8),
                          orbit_camera(0.7 * number), None, None, None, None, None, {},
                          depth=depth) for number, depth in enumerate(depths)]
    episode = RecordedEpisode('one', SECOND, None, views, '')
    parameters = {'/reconstructor': {'object_size': 1.0, 'use_depth': use_depth,
                                     'max_depth_gap': 0.02}}
    run = RecordedRun(folder, [episode], {}, parameters, {}, (), SECOND, 9 * SECOND)
    write_run(run, folder)
    return read_run(folder).episodes[0].views


BAG_DEPTH = np.random.default_rng(0).uniform(1, 3, (137, 137)).astype(np.float32)


def test_depth_in_a_bag_belongs_to_its_view_and_is_read_where_the_loop_used_it(tmp_path):
    depths = [DepthImage(BAG_DEPTH), None, DepthImage(BAG_DEPTH + 1)]
    found = run_with_depth(tmp_path / 'used', depths)
    assert [view.depth is None for view in found] == [False, True, False]
    for view, written in zip(found, depths, strict=True):
        if written is not None:
            np.testing.assert_array_equal(view.depth.metres, written.metres)
            assert view.depth.camera == view.camera
    unused = run_with_depth(tmp_path / 'unused', depths, use_depth=False)
    assert all(view.depth is None for view in unused)


def test_a_depth_camera_s_own_info_is_its_lens_at_the_pose_of_the_image(tmp_path):
    camera = orbit_camera(0.0)
    own = replace(camera, intrinsics=CANONICAL_INTRINSICS.resized(64, 48))
    view, = run_with_depth(tmp_path / 'own', [DepthImage(BAG_DEPTH[:48, :64], own)])
    assert view.depth.camera.intrinsics == own.intrinsics
    np.testing.assert_allclose(view.depth.camera.pose, camera.pose, atol=1e-9)


def test_a_depth_image_has_the_lens_of_its_own_time(tmp_path):
    sizes = (64, 48), (137, 137), (32, 24)
    depths = [DepthImage(BAG_DEPTH[:height, :width], replace(
        orbit_camera(0.0), intrinsics=CANONICAL_INTRINSICS.resized(width, height)))
        for width, height in sizes]
    views = run_with_depth(tmp_path / 'zoom', depths)
    assert [view.depth.camera.intrinsics for view in views] == [
        depth.camera.intrinsics for depth in depths]


def test_an_info_of_no_calibrated_depth_camera_is_as_good_as_none(tmp_path, monkeypatch):
    def uncalibrated(stamp, depth):
        header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id='camera')
        return depth_to_msgs(stamp, depth) | {
            'camera/depth/camera_info': CameraInfo(header=header, width=137, height=137)}

    monkeypatch.setattr(run_writing, 'depth_to_msgs', uncalibrated)
    view, = run_with_depth(tmp_path / 'bag', [DepthImage(BAG_DEPTH)])
    np.testing.assert_array_equal(view.depth.metres, BAG_DEPTH)


def test_compressed_depth_in_a_bag_is_read_as_raw_depth_is(tmp_path, monkeypatch):
    def compressed(stamp, depth):
        (_, raw), = depth_to_msgs(stamp, depth).items()
        return {'camera/depth/image_raw/compressedDepth':
                depth_to_compressed_msg(depth_from_msg(raw), raw.header)}

    monkeypatch.setattr(run_writing, 'depth_to_msgs', compressed)
    found = run_with_depth(tmp_path / 'bag', [DepthImage(BAG_DEPTH), None])
    assert [view.depth is None for view in found] == [False, True]
    np.testing.assert_allclose(found[0].depth.metres, BAG_DEPTH, atol=0.0005 + 1e-6)


def in_compressed_depth(metres, near=1.0, far=5.0):
    """Return depth as compressed_depth_image_transport writes 32FC1: rint(A / metres + B)."""
    scale = near * (near + 1)
    offset = 1 - scale / far
    values = np.where(metres > 0, np.rint(scale / np.where(metres > 0, metres, 1) + offset), 0)
    packed = cv2.imencode('.png', values.astype(np.uint16))[1].tobytes()
    return CompressedImage(format='32FC1; compressedDepth png', data=array(
        'B', struct.pack('<iff', 1, scale, offset) + packed))


def test_compressed_depth_comes_back_to_the_millimetre_and_so_does_its_absence():
    metres = METRES.copy()
    metres[0, :4] = math.nan, math.inf, 0, 70
    msg = depth_to_compressed_msg(metres, Header(frame_id='camera'))
    assert msg.header.frame_id == 'camera' and msg.format == '16UC1; compressedDepth png'
    expected = metres.copy()
    expected[0, :4] = 0
    np.testing.assert_allclose(metres_from_msg(msg), expected, atol=0.0005 + 1e-6)
    np.testing.assert_array_equal(  # what it has lost is lost once
        metres_from_msg(depth_to_compressed_msg(metres_from_msg(msg), msg.header)),
        metres_from_msg(msg))


def test_floats_come_back_within_half_a_step_of_their_inverse():
    near = 30.0
    metres = METRES.copy()
    metres[0, 0] = 0
    found = metres_from_msg(in_compressed_depth(metres, near))
    assert found[0, 0] == 0
    there = metres > 0
    scale = near * (near + 1)
    assert (np.abs(1 / found[there] - 1 / metres[there]) <= 0.5 / scale + 1e-6).all()


@pytest.mark.parametrize('encoding', ['16UC1', 'mono16'])
def test_either_message_gives_the_same_metres(encoding):
    raw = in_millimetres(METRES)
    raw.encoding = encoding
    packed = depth_to_compressed_msg(depth_from_msg(raw), Header())
    packed.format = f'{encoding}; compressedDepth png'  # as image_transport names it
    np.testing.assert_array_equal(metres_from_msg(raw), metres_from_msg(packed))


@pytest.mark.parametrize(('change', 'said'), [
    ({'format': '16UC1; compressedDepth rvl'}, 'set png as the format of its publisher'),
    ({'format': 'rgb8; jpeg compressed bgr8'}, 'unknown compressed depth: expected'),
    ({'data': array('B', b'short')}, 'unreadable: expected a header of 12 bytes'),
    ({'data': array('B', bytes(12) + b'\x89PNG\r\n\x1a\n' + bytes(40))}, 'of 16 bits'),
    ({'data': array('B', bytes(12) + b'\x89PNG\r\n\x1a\n' + bytes(8) + b'\xff' * 8)}, 'too large'),
    ({'data': array('B', bytes(12) + cv2.imencode('.png', np.zeros((2, 2), np.uint8))[1].tobytes()
                    )}, '16 bits and one channel')])
def test_other_compressed_messages_are_no_depth(change, said):
    msg = depth_to_compressed_msg(METRES, Header())
    for name, value in change.items():
        setattr(msg, name, value)
    with pytest.raises(MessageError, match=said):
        metres_from_msg(msg)


def test_floats_without_their_scale_are_no_depth():
    msg = in_compressed_depth(METRES)
    msg.data = array('B', bytes(12) + bytes(msg.data)[12:])
    with pytest.raises(MessageError, match='without its scale'):
        metres_from_msg(msg)
