"""Depth in bags of other recorders: registered to the images, or beside them by transforms."""

from dataclasses import replace
from pathlib import Path

import active_recon
from active_recon.bags.replay.replay import replay
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.rebuilt import rebuilt
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.rotations import matrix_from_quaternion
from active_recon.report.findings import findings
from active_recon.report.subject import Subject
from active_recon.volumes.depth_images import DepthImage, registered
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
from command_line import command
from foreign_recordings import tf_message
from loop_bags import BEGIN, header, LoopRun, PERIOD, write_bag
from msg_tools.cameras import intrinsics_to_msg, pose_to_msg
from msg_tools.compressed_depth import depth_to_compressed_msg
from msg_tools.images import depth_to_msg, image_to_msg
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures('loaded_once')
CAMERAS = [orbit_camera(azimuth, 0.5, intrinsics=CANONICAL_INTRINSICS) for azimuth in (0.3, 2.0)]
FRAME = 'color_optical_frame'


@pytest.fixture(scope='module')
def chair():
    """Return the renderer of a chair that ships, and its voxels."""
    mesh = load_mesh(Path(active_recon.__file__).parent / 'objects' / 'chair.glb')
    return Renderer(mesh), voxelise(mesh, 64).occupied(0.5)


def beside(camera):
    """Return a depth camera a hand's breadth beside a camera, turned a little, with its lens."""
    moved = np.eye(4)
    moved[:3, :3] = matrix_from_quaternion((0.01, -0.02, 0.015, 1))
    moved[:3, 3] = 0.05, 0.01, -0.01
    return Camera(camera.pose @ moved, CANONICAL_INTRINSICS.resized(160, 120))


def recording(renderer, depth_camera=lambda camera: camera, by_tf=False, compressed=False):
    """Yield a robot's messages: color, depth and cameras, standing still at two places."""
    for number in range(2 * 3):
        time, camera = BEGIN + number * PERIOD, CAMERAS[number // 3]
        deep = depth_camera(camera)
        apart = deep is not camera
        stamp = header(time, FRAME)
        image = composite(renderer.render(camera, 1), 255)
        depth = depth_to_msg(renderer.depth(deep),
                             header(time + 1000, 'depth_optical_frame' if apart else FRAME))
        if compressed:
            depth = depth_to_compressed_msg(renderer.depth(deep), depth.header)
        yield time, '/wrist/color/image_raw', image_to_msg(image, stamp)
        yield time, '/wrist/color/camera_info', intrinsics_to_msg(camera.intrinsics, stamp)
        topic = '/wrist/depth/image_rect_raw'
        yield time, f'{topic}/compressedDepth' if compressed else topic, depth
        if apart:
            yield time, '/wrist/depth/camera_info', intrinsics_to_msg(deep.intrinsics, stamp)
        if not by_tf:
            yield time, '/tracker', pose_to_msg(camera.pose, header(time, 'object'))
            continue
        for each in (time, time + 2000):
            yield each, '/tf', tf_message(camera.pose, 'object', FRAME, each)
        if apart:
            yield time, '/tf_static', tf_message(np.linalg.inv(camera.pose) @ deep.pose, FRAME,
                                                 'depth_optical_frame', 0)


def reconstructed(folder, voxels, depth='/wrist/depth/image_rect_raw'):
    run = read_run(folder, Topics(depth=depth))
    setup = recorded_setup(run)
    (episode,) = replay(run, setup.load_reconstructor())
    assert not any(step.reconstruction.depth_refusal for step in episode.steps)
    return run, [float(iou(step.reconstruction.grid.occupied(0.4), voxels))
                 for step in episode.steps]


@pytest.fixture(scope='module')
def aligned(chair, loaded_once, tmp_path_factory):
    """Return a bag of images with depth of their pixels, its run, and the IoU of each view."""
    folder = write_bag(tmp_path_factory.mktemp('aligned') / 'run', recording(chair[0]))
    return folder, *reconstructed(folder, chair[1])


def test_depth_of_a_topic_makes_the_shape_better(chair, aligned):
    folder, run, deep = aligned
    assert all(view.depth is not None for view in run.episodes[0].views)
    run, color = reconstructed(folder, chair[1], depth='')
    assert all(view.depth is None for view in run.episodes[0].views)
    assert min(np.subtract(deep, color)) > 0.03


@pytest.fixture(scope='module')
def apart(chair, tmp_path_factory):
    """Return a bag of images with depth from beside the camera."""
    return write_bag(tmp_path_factory.mktemp('apart') / 'run',
                     recording(chair[0], beside, by_tf=True))


def test_depth_from_beside_the_camera_is_registered_by_the_transforms(chair, aligned, apart):
    renderer, voxels = chair
    run, found = reconstructed(apart, voxels)
    for view, camera in zip(run.episodes[0].views, CAMERAS, strict=True):
        np.testing.assert_allclose(view.depth.camera.pose, camera.pose, atol=1e-9)
        there = view.depth.metres > 0
        direct = renderer.depth(view.depth.camera)
        both = there & (direct > 0)
        assert both.sum() > 0.7 * (direct > 0).sum()
        assert np.median(np.abs(view.depth.metres - direct)[both]) < 0.005
    assert min(np.subtract(found, aligned[2])) > -0.03


def test_aligned_depth_in_the_images_wrong_frame_is_of_the_camera_that_is_named(chair, tmp_path):
    off = np.eye(4)
    off[:3, 3] = 0.06, 0.03, 0
    messages = [(BEGIN, '/tf_static', tf_message(off, 'real_optical_frame', FRAME, 0))]
    for time, topic, msg in recording(chair[0], by_tf=True):
        if topic == '/tf':
            msg.transforms[0].child_frame_id = 'real_optical_frame'
        messages.append((time, topic, msg))
    depth = '/wrist/depth/image_rect_raw'
    (found,) = read_run(write_bag(tmp_path / 'wrong', messages),
                        Topics(depth=depth, camera_frame='real_optical_frame')).episodes
    (right,) = read_run(write_bag(tmp_path / 'right', recording(chair[0], by_tf=True)),
                        Topics(depth=depth)).episodes
    for view, expected in zip(found.views, right.views, strict=True):
        np.testing.assert_allclose(view.camera.pose, expected.camera.pose, atol=1e-9)
        np.testing.assert_allclose(view.depth.metres, expected.depth.metres, atol=1e-5)


def test_compressed_depth_is_found_by_its_own_topic(chair, aligned, tmp_path):
    renderer, voxels = chair
    _, packed = reconstructed(
        write_bag(tmp_path / 'packed', recording(renderer, compressed=True)), voxels,
        depth='wrist/depth/image_rect_raw/compressedDepth')
    assert packed == pytest.approx(aligned[2], abs=0.01)


def test_what_replay_writes_with_depth_is_replayed_with_it(apart, tmp_path, monkeypatch, capsys):
    options = ('--depth', '/wrist/depth/image_rect_raw')
    assert command(monkeypatch, 'replay', apart, *options, '--threshold', 0.5,
                   '--out', tmp_path / 'new') == 0
    assert command(monkeypatch, 'replay', tmp_path / 'new') == 0
    assert 'same bits' in capsys.readouterr().out
    assert command(monkeypatch, 'replay', apart, *options) == 0
    assert 'reconstructed from 2 views, 2 with depth: ' in capsys.readouterr().out
    assert command(monkeypatch, 'bag', 'info', apart, *options) == 0
    assert '2 views at azimuths 17, 115 degrees, 2 with depth' in capsys.readouterr().out


def test_depth_that_cannot_be_used_is_told_and_the_views_go_on(
        chair, tmp_path, monkeypatch, capsys):
    far = [(time, topic, depth_to_msg(np.full((137, 137), 9.0, np.float32), msg.header)
            if 'depth' in topic else msg) for time, topic, msg in recording(chair[0])]
    folder = write_bag(tmp_path / 'run', far)
    assert command(monkeypatch, 'replay', folder, '--depth', '/wrist/depth/image_rect_raw') == 0
    assert 'depth of 2 of them was left out: depth contradicts' in capsys.readouterr().out
    run, _ = rebuilt(read_run(folder, Topics(depth='/wrist/depth/image_rect_raw')), Scene())
    said = [found.text for found in findings(Subject('A', run, run.episodes[0]))]
    assert 'The reconstructor warned twice of a depth image that could not be used.' in said


def test_depth_topics_that_are_none_or_not_connected_are_refused(chair, tmp_path):
    folder = write_bag(tmp_path / 'run', recording(chair[0]))
    with pytest.raises(DataError, match='no depth images on /deep: .* --depth'):
        read_run(folder, Topics(depth='/deep'))
    lost = [(time, topic, msg) for time, topic, msg in recording(chair[0], beside, by_tf=True)
            if topic != '/tf_static']
    with pytest.raises(DataError, match="for any view: no transforms .* 'depth_optical_frame'"):
        read_run(write_bag(tmp_path / 'lost', lost), Topics(depth='/wrist/depth/image_rect_raw'))
    loop = LoopRun()
    with pytest.raises(ConfigError, match='--depth: not needed: the bag has the views of a loop'):
        read_run(write_bag(tmp_path / 'loop', loop.messages), Topics(depth='/deep'))


def test_depth_of_another_size_than_its_lens_is_left_out_with_its_reason(
        chair, tmp_path, monkeypatch, capsys):
    messages = [(time, topic, msg) for time, topic, msg in recording(chair[0], beside, by_tf=True)
                if topic != '/wrist/depth/camera_info']
    folder = write_bag(tmp_path / 'run', messages)
    assert command(monkeypatch, 'replay', folder, '--depth', '/wrist/depth/image_rect_raw') == 0
    assert 'of 2 of them was left out: wrong depth image: expected 137' in capsys.readouterr().out


def test_a_replay_with_another_model_tells_what_was_assumed_and_left_out(
        chair, tmp_path, monkeypatch, capsys):
    late = BEGIN + 10**10
    lost = (late, '/wrist/color/image_raw',
            image_to_msg(np.zeros((137, 137, 3), np.uint8), header(late, FRAME)))
    folder = write_bag(tmp_path / 'run', [*recording(chair[0]), lost])
    assert command(monkeypatch, 'replay', folder, '--depth', '/wrist/depth/image_rect_raw',
                   '--model', '2d3d', '--out', tmp_path / 'other') == 0
    said = capsys.readouterr().out
    assert "assumed: the object's cube has a side of 1 m (--object-size)" in said
    assert '1 image was dropped: no camera pose arrived' in said
    assert 'depth of 2 of them was left out: 2d3d.safetensors: takes no depth' in said


def test_depth_that_no_view_has_is_refused_with_the_reason(chair, tmp_path):
    metres = np.ones((137, 137), np.float32)
    late = [(time, topic, depth_to_msg(metres, header(time + 10**10, FRAME))
             if 'depth' in topic else msg) for time, topic, msg in recording(chair[0])]
    with pytest.raises(DataError, match='for any view: expected some within 0.02 s of an image'):
        read_run(write_bag(tmp_path / 'late', late), Topics(depth='/wrist/depth/image_rect_raw'))
    with pytest.raises(DataError, match='for any view: .*rgb8'):
        read_run(write_bag(tmp_path / 'color', recording(chair[0])),
                 Topics(image='/wrist/color/image_raw', depth='/wrist/color/image_raw'))


def test_depth_beside_a_camera_that_is_assumed_is_refused(chair, tmp_path):
    without = [entry for entry in recording(chair[0]) if 'camera_info' not in entry[1]]
    with pytest.raises(ConfigError, match="--depth needs the camera's pose and lens: .*the lens"):
        read_run(write_bag(tmp_path / 'run', without), Topics(depth='/wrist/depth/image_rect_raw'))


def test_depth_registered_to_its_own_pose_stays_as_it_is(chair):
    metres = chair[0].depth(CAMERAS[0])
    found = registered(DepthImage(metres, CAMERAS[0]), CAMERAS[0].pose)
    np.testing.assert_allclose(found.metres, metres, atol=1e-5)
    assert np.array_equal(found.camera.pose, CAMERAS[0].pose)
    assert found.camera.intrinsics == CAMERAS[0].intrinsics


def test_a_plane_registered_to_another_pose_is_where_its_rays_meet_it():
    camera, other = (replace(each, intrinsics=CANONICAL_INTRINSICS.resized(60, 50))
                     for each in (CAMERAS[0], beside(CAMERAS[0])))

    def of_plane(seen_by):  # x = 0
        return -seen_by.position[0] / seen_by.ray_directions()[..., 0]

    found = registered(DepthImage(of_plane(other), other), camera.pose)
    there = found.metres > 0
    assert there.mean() > 0.7
    np.testing.assert_allclose(found.metres[there], of_plane(camera)[there], rtol=0.02)
