"""Other people's bags: their topics and types, and the views that the gate finds in them."""

import math

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.errors import DataError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS
from foreign_recordings import AZIMUTHS, cameras, IMAGES, images, joints, png, TIMES
from loop_bags import BEGIN, DELAY, header, PERIOD, type_name, write_bag
from mcap.writer import Writer as McapWriter
from msg_tools.images import image_to_msg
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recorded_messages import definition
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header


def views(folder, messages, **topics):
    run = read_run(write_bag(folder, sorted(messages, key=lambda entry: entry[0])),
                   Topics(**topics))
    (episode,) = run.episodes
    return episode.views


def azimuths(found):
    return pytest.approx([view.camera.azimuth for view in found])


@pytest.mark.parametrize('make', [image_to_msg, png])
def test_images_and_the_joint_of_a_turntable_are_views(tmp_path, make):
    found = views(tmp_path / 'run', images(make=make) + joints())
    assert azimuths(found) == AZIMUTHS
    for view, image in zip(found, IMAGES, strict=True):
        assert np.array_equal(view.image, image)
        assert view.camera.elevation == pytest.approx(math.radians(30))
        lens = view.camera.intrinsics  # the shorter side is what the canonical camera sees
        assert lens.fy / 24 == pytest.approx(CANONICAL_INTRINSICS.fy / 137)
        assert (lens.fx, lens.cx, lens.cy) == (lens.fy, 16, 12)


def test_types_of_an_mcap_file_may_be_named_without_msg(tmp_path):
    messages = sorted(images() + joints(), key=lambda entry: entry[0])
    with (tmp_path / 'bag.mcap').open('wb') as file:
        writer = McapWriter(file)
        writer.start('ros2', 'a test')
        channels = {}
        for time, topic, msg in messages:
            if topic not in channels:
                name = type_name(msg)
                schema = writer.register_schema(
                    name.replace('/msg/', '/'), 'ros2msg', definition(name).encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic], time, serialize_message(msg), time)
        writer.finish()
    named = read_run(write_bag(tmp_path / 'run', messages))
    shortly = read_run(tmp_path / 'bag.mcap')
    assert [(topic.name, topic.type_name) for topic in shortly.topics] == [
        (topic.name, topic.type_name) for topic in named.topics]
    assert [view.stamp for view in shortly.episodes[0].views] == [
        view.stamp for view in named.episodes[0].views] != []


def test_a_turned_object_is_a_camera_that_goes_the_other_way(tmp_path):
    found = views(tmp_path / 'run', images() + joints(sign=-1), turned_object=True)
    assert azimuths(found) == AZIMUTHS


def test_one_joint_of_several_is_chosen_by_its_name(tmp_path):
    folder = write_bag(tmp_path / 'run', images() + joints(names=('lift', 'turn')))
    (episode,) = read_run(folder, Topics(joint='turn')).episodes
    assert azimuths(episode.views) == AZIMUTHS
    with pytest.raises(DataError, match='on /table, lift, turn: choose one with --joint'):
        read_run(folder)
    with pytest.raises(DataError, match='no joint tilt on /table: expected one of lift, turn'):
        read_run(folder, Topics(joint='tilt'))


def test_joints_that_come_one_by_one_are_not_taken_for_one(tmp_path):
    lift = [(time + 1, '/table', JointState(
        header=header(time + 1, ''), name=['lift'], position=[1.0])) for time, _ in TIMES]
    folder = write_bag(tmp_path / 'run', images() + joints() + lift)
    (episode,) = read_run(folder, Topics(joint='turn')).episodes
    assert azimuths(episode.views) == AZIMUTHS
    with pytest.raises(DataError, match='several joints on /table, lift, turn'):
        read_run(folder)


def test_messages_of_other_joints_than_the_chosen_one_are_no_fault(tmp_path):
    arm = [(time + 1, '/table', JointState(
        header=header(time + 1, ''), name=['lift', 'tilt'], position=[1.0, 2.0]))
        for time, _ in TIMES]
    runs = [read_run(write_bag(tmp_path / name, messages), Topics(joint='turn'))
            for name, messages in (('alone', images() + joints()),
                                   ('both', images() + joints() + arm))]
    assert runs[1].counters == runs[0].counters
    assert not any(name.startswith('refused') for name in runs[1].counters['bag'])


def test_a_float_is_joined_on_receive_times(tmp_path):
    floats = [(time + 1, '/angle', Float64(data=AZIMUTHS[number])) for time, number in TIMES]
    first = [(BEGIN - 1, '/angle', Float64(data=AZIMUTHS[0]))]
    found = views(tmp_path / 'run', images() + first + floats)
    assert azimuths(found) == AZIMUTHS


def test_joints_without_stamps_are_joined_on_receive_times(tmp_path):
    unstamped = joints()
    for _, _, msg in unstamped:
        msg.header = Header()
    assert azimuths(views(tmp_path / 'run', images() + unstamped)) == AZIMUTHS


@pytest.mark.parametrize('poses', [joints, lambda: list(cameras(late=2))])
def test_images_without_stamps_are_joined_on_receive_times_and_stamped_with_them(tmp_path, poses):
    unstamped = images()
    for _, _, msg in unstamped:
        msg.header = Header()
    found = views(tmp_path / 'run', unstamped + poses())
    assert azimuths(found) == AZIMUTHS
    assert {view.stamp - DELAY for view in found} <= {time for time, _ in TIMES}


def test_images_from_before_a_simulations_clock_leave_the_others_their_stamps(tmp_path):
    early = [(BEGIN - index * PERIOD, '/cam/color', image_to_msg(IMAGES[0], header(0, 'camera')))
             for index in range(1, 4)]
    late = [(time + 3 * PERIOD, topic, msg) for time, topic, msg in images()]
    found = views(tmp_path / 'run', early + late + joints())
    assert azimuths(found) == AZIMUTHS
    assert {view.stamp for view in found} <= {time for time, _ in TIMES}
    for view, image in zip(found, IMAGES, strict=True):
        assert np.array_equal(view.image, image)
    assert read_run(tmp_path / 'run').gaps.missing == 0


def test_camera_info_without_stamps_is_joined_on_receive_times(tmp_path):
    messages = [*images(), *cameras()]
    zoomed = TIMES[3][0]  # where the camera stands for the second time
    for time, topic, msg in messages:
        msg.header = header(0, msg.header.frame_id)
        if topic == '/info':
            focal = 40.0 if time >= zoomed else 30.0
            msg.k = [focal, 0.0, 16.0, 0.0, focal, 12.0, 0.0, 0.0, 1.0]
    found = views(tmp_path / 'run', messages)
    assert azimuths(found) == AZIMUTHS
    assert [view.camera.intrinsics.fx for view in found] == [30, 40, 40]


def test_of_a_fast_joint_only_the_angles_around_an_image_become_poses(tmp_path, monkeypatch):
    placed = []
    monkeypatch.setattr(Scene, 'pose_at', lambda self, angle, turned: (
        placed.append(angle), self.orbit_pose(angle))[1])
    fast = [(time + step * PERIOD // 100, '/table', JointState(
        header=header(time + step * PERIOD // 100, ''), name=['turn'],
        position=[AZIMUTHS[number]])) for time, number in TIMES for step in range(-50, 50)]
    assert azimuths(views(tmp_path / 'run', images() + fast)) == AZIMUTHS
    assert len(placed) <= 3 * len(TIMES)


def test_camera_info_of_no_calibrated_camera_is_as_good_as_none(tmp_path):
    messages = [*images(), *cameras()]
    for _, topic, msg in messages:
        if topic == '/info':
            msg.k = [0.0] * 9
    run = read_run(write_bag(tmp_path / 'run', messages))
    assert run.counters['bag']['refused/unusable_camera_info'] == len(TIMES)
    found = run.episodes[0].views
    assert azimuths(found) == AZIMUTHS
    assert found[0].camera.distance == pytest.approx(2.1)
    assert found[0].camera.intrinsics.fy / 24 == pytest.approx(CANONICAL_INTRINSICS.fy / 137)


def test_camera_info_of_an_unknown_lens_is_told_among_what_is_assumed(tmp_path):
    messages = [*images(), *cameras()]
    for _, topic, msg in messages:
        if topic == '/info':
            msg.distortion_model, msg.d = 'fisheye', [0.1, 0.0, 0.0, 0.0]
    run = read_run(write_bag(tmp_path / 'run', messages))
    assert run.assumed[-1].startswith(
        'of the recorded camera info nothing: unknown distortion model')
    assert "got 'fisheye'" in run.assumed[-1]


def test_of_two_cameras_the_info_beside_the_chosen_images_is_theirs(tmp_path):
    messages = [entry for entry in cameras() if entry[1] == '/tracker']
    lenses = {'/camera': 30.0, '/camera2': 40.0}
    for camera, focal in lenses.items():
        messages += images(f'{camera}/image_raw')
        for time, topic, msg in cameras():
            if topic == '/info':
                msg.k = [focal, 0.0, 16.0, 0.0, focal, 12.0, 0.0, 0.0, 1.0]
                messages.append((time, f'{camera}/camera_info', msg))
    folder = write_bag(tmp_path / 'run', messages)
    for camera, focal in lenses.items():
        (episode,) = read_run(folder, Topics(image=f'{camera}/image_raw')).episodes
        assert episode.views[0].camera.intrinsics.fx == focal


def test_a_pose_and_the_camera_info_are_the_camera_as_it_was(tmp_path):
    found = views(tmp_path / 'run', [*images(), *cameras()])
    assert azimuths(found) == AZIMUTHS
    assert found[1].camera.distance == pytest.approx(3.0)
    assert found[1].camera.intrinsics.fx == pytest.approx(CANONICAL_INTRINSICS.fx * 32 / 137)


def test_the_option_that_names_the_frame_of_the_poses_is_told_where_they_have_another(tmp_path):
    moved = list(cameras())
    for _, topic, msg in moved:
        if topic == '/tracker':
            msg.header.frame_id = 'base_link'
    with pytest.raises(DataError, match="expected 'object', got 'base_link'; name it with "
                                        '--object-frame'):
        views(tmp_path / 'run', [*images(), *moved])
    assert azimuths(views(tmp_path / 'named', [*images(), *moved],
                          object_frame='base_link')) == AZIMUTHS


def test_a_pose_between_two_is_interpolated_within_the_gap(tmp_path):
    messages = [*images(), *cameras(late=PERIOD // 2)]
    found = views(tmp_path / 'run', messages)
    assert found[-1].camera.azimuth == pytest.approx(AZIMUTHS[-1])
    with pytest.raises(DataError, match='no image has a known camera: .*within 0.01 s'):
        views(tmp_path / 'short', messages, max_pose_gap=0.01)


def test_images_before_the_first_pose_are_not_the_reason_where_there_is_another(tmp_path):
    with pytest.raises(DataError, match='no pose for the image of 1700000000.100 s'):
        views(tmp_path / 'run', [*images(), *cameras(late=PERIOD // 2)], max_pose_gap=0.01)


def test_without_camera_info_a_pose_tells_its_azimuth_alone(tmp_path):
    poses = [entry for entry in cameras() if entry[1] == '/tracker']
    found = views(tmp_path / 'run', images() + poses)
    assert azimuths(found) == AZIMUTHS
    assert found[0].camera.distance == pytest.approx(2.1)


def test_topics_of_one_kind_are_told_apart_by_name_with_or_without_the_slash(tmp_path):
    folder = write_bag(tmp_path / 'run', images() + images('/cam/depth') + joints())
    with pytest.raises(DataError, match='/cam/color, /cam/depth: choose one with --image'):
        read_run(folder)
    for name in ('/cam/color', 'cam/color'):
        (episode,) = read_run(folder, Topics(image=name)).episodes
        assert len(episode.views) == 3
    with pytest.raises(DataError, match='no camera images on /cam/none: expected'):
        read_run(folder, Topics(image='/cam/none'))


def test_a_compressed_camera_is_not_passed_over_for_another_that_is_raw(tmp_path):
    packed = images('/color/image_raw/compressed', png)
    infrared = images('/infra1/image_rect_raw')
    with pytest.raises(DataError, match='on several topics, /color/image_raw/compressed, '
                                        '/infra1/image_rect_raw: choose one with --image'):
        views(tmp_path / 'two', packed + infrared + joints())
    found = views(tmp_path / 'one', packed + images('/color/image_raw') + joints())
    assert azimuths(found) == AZIMUTHS  # compressed or raw, it is one camera


def test_a_camera_that_never_stands_still_gives_no_view(tmp_path):
    turning = [(time, '/angle', Float64(data=index / 5)) for index, (time, _) in enumerate(TIMES)]
    with pytest.raises(DataError, match='expected a camera that stops, got 9 images'):
        views(tmp_path / 'run', images() + turning)
