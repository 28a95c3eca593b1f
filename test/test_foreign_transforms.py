"""Bags of robots whose camera is known by transforms alone: /tf and /tf_static."""

from dataclasses import replace

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import orbit_camera
from command_line import command
from foreign_recordings import AZIMUTHS, cameras, IMAGES, images, joints, tf_message, transforms
from loop_bags import BEGIN, message_data, PERIOD, type_name, write_bag
import numpy as np
import pytest
from recorded_messages import STORE
from rosbags.rosbag2 import StoragePlugin, Writer

LENSES = [entry for entry in cameras() if entry[1] == '/info']
POSES = [orbit_camera(azimuth, 0.4, 3.0).pose for azimuth in AZIMUTHS]


def bag(folder, *messages):
    return write_bag(folder, sorted((entry for part in messages for entry in part),
                                    key=lambda entry: entry[0]))


def poses(run):
    (episode,) = run.episodes
    return [view.camera.pose for view in episode.views]


def test_the_pose_of_the_images_frame_in_the_objects_is_that_of_the_camera(tmp_path):
    run = read_run(bag(tmp_path / 'run', images(), LENSES, transforms()))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    assert run.assumed == ["the object's cube has a side of 1 m (--object-size)"]
    (episode,) = run.episodes
    for view, image in zip(episode.views, IMAGES, strict=True):
        assert np.array_equal(view.image, image)


@pytest.mark.parametrize('plugin', StoragePlugin)
def test_bags_that_rosbags_wrote_are_read_so_too(tmp_path, plugin):
    messages = sorted([*images(), *LENSES, *transforms()], key=lambda entry: entry[0])
    with Writer(tmp_path / 'run', version=9, storage_plugin=plugin) as rosbag2:
        connections = {}
        for time, topic, msg in messages:
            kind = type_name(msg)
            if topic not in connections:
                connections[topic] = rosbag2.add_connection(topic, kind, typestore=STORE)
            rosbag2.write(connections[topic], time, message_data(msg))
    np.testing.assert_allclose(poses(read_run(tmp_path / 'run')), POSES, atol=1e-9)


def test_transforms_between_images_are_interpolated_within_the_gap(tmp_path):
    folder = bag(tmp_path / 'run', images(), LENSES, transforms(late=PERIOD // 5))
    run = read_run(folder)
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    run = read_run(folder, Topics(max_pose_gap=0.9 * PERIOD / 1e9))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    with pytest.raises(DataError, match="'tool0' .* within 0.05 s .* one 0.020 s after"):
        read_run(folder, Topics(max_pose_gap=0.05))


def test_images_from_before_the_first_transform_are_left_out_and_no_fault(tmp_path):
    later = [entry for entry in transforms() if entry[0] >= BEGIN + PERIOD
             or entry[1] == '/tf_static']
    run = read_run(bag(tmp_path / 'run', images(), LENSES, later))
    assert len(poses(run)) == 3
    assert run.counters['bag']['images_unused'] >= 1
    assert not any(name.startswith('refused') for name in run.counters['bag'])


def test_an_objects_place_in_the_robots_frame_becomes_the_origin(tmp_path, monkeypatch, capsys):
    place = np.array([0.6, -0.2, 0.1])
    moved = []
    for time, topic, msg in transforms(base='base_link'):
        if topic == '/tf':
            position = msg.transforms[0].transform.translation
            position.x, position.y, position.z = (position.x + place[0], position.y + place[1],
                                                  position.z + place[2])
        moved.append((time, topic, msg))
    folder = bag(tmp_path / 'run', images(), LENSES, moved)
    run = read_run(folder, Topics(object_frame='base_link'), Scene(object_position=place))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    assert command(monkeypatch, 'bag', 'info', folder, '--object-frame', 'base_link',
                   '--object-position', '0.6,-0.2,0.1', '--object-size', '1') == 0
    said = capsys.readouterr().out
    assert 'can be replayed' in said
    assert 'azimuths 0, 86, 172 degrees' in said


def test_a_tracker_may_begin_at_its_own_origin_where_the_object_is_elsewhere(tmp_path):
    moved = list(cameras())
    for _, topic, msg in moved:
        if topic == '/tracker':
            place = msg.pose.position
            place.x, place.y, place.z = np.array([place.x, place.y, place.z]) - POSES[0][:3, 3]
    run = read_run(bag(tmp_path / 'run', images(), moved),
                   scene=Scene(object_position=-POSES[0][:3, 3]))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_transforms_with_the_objects_frame_are_preferred_to_joints(tmp_path):
    arm = joints(topic='/joint_states', names=('shoulder', 'elbow'))
    run = read_run(bag(tmp_path / 'run', images(), LENSES, arm, transforms()))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_a_pose_in_the_objects_frame_is_preferred_to_transforms(tmp_path):
    elsewhere = transforms(tool='other', camera='rear')
    run = read_run(bag(tmp_path / 'run', images(), cameras(), elsewhere))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_joints_are_used_where_transforms_lack_the_objects_frame(tmp_path):
    run = read_run(bag(tmp_path / 'run', images(), joints(), transforms('odom')))
    (episode,) = run.episodes
    assert [view.camera.azimuth for view in episode.views] == pytest.approx(AZIMUTHS)


def test_a_transform_that_is_not_finite_is_left_out_and_counted(tmp_path):
    broken = np.eye(4)
    broken[0, 3] = np.nan
    bad = [(BEGIN + 5, '/tf', tf_message(broken, 'object', 'marker', BEGIN + 5))]
    run = read_run(bag(tmp_path / 'run', images(), LENSES, transforms(), bad))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    assert run.counters['bag']['refused/unusable_transform'] == 1


def test_only_transforms_that_reach_the_camera_take_the_place_of_other_topics(tmp_path):
    unrelated = [(BEGIN, '/tf_static', tf_message(POSES[0], 'world', 'object', 0))]
    run = read_run(bag(tmp_path / 'turntable', images(), joints(), unrelated))
    (episode,) = run.episodes
    assert [view.camera.azimuth for view in episode.views] == pytest.approx(AZIMUTHS)
    goal = [(time, '/move_goal', msg) for time, topic, msg in cameras() if topic == '/tracker']
    for _, _, msg in goal:
        msg.header.frame_id = 'base_link'
    run = read_run(bag(tmp_path / 'arm', images(), LENSES, goal, transforms()))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_transforms_of_a_robots_namespace_go_with_the_static_ones_of_all(tmp_path):
    named = [(time, topic.replace('/tf', '/robot/tf') if topic == '/tf' else topic, msg)
             for time, topic, msg in transforms()]
    rear = [(time, f'/rear{topic}', msg) for time, topic, msg in transforms('odom', 'x', 'y')
            if topic == '/tf']
    run = read_run(bag(tmp_path / 'run', images(), LENSES, named, rear))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_of_two_robots_with_the_same_frames_one_has_to_be_named(tmp_path):
    both = [[(time, f'/{robot}{topic}', msg) for time, topic, msg in transforms()]
            for robot in ('left', 'right')]
    folder = bag(tmp_path / 'run', images(), LENSES, *both)
    with pytest.raises(DataError, match='on several topics, /left/tf, /right/tf: choose one'):
        read_run(folder)
    np.testing.assert_allclose(
        poses(read_run(folder, Topics(azimuth='/right/tf'))), POSES, atol=1e-9)


def test_a_first_slash_of_a_frame_does_not_count(tmp_path):
    run = read_run(bag(tmp_path / 'run', images(), LENSES, transforms('/object', '/tool0')),
                   Topics(object_frame='/object'))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)


def test_the_cameras_frame_is_named_where_that_of_the_images_is_not_the_optical_one(tmp_path):
    moved = transforms(camera='real_optical_frame')
    wrong = [(BEGIN, '/tf_static', tf_message(np.eye(4)[[1, 2, 0, 3]], 'tool0', 'camera', 0))]
    folder = bag(tmp_path / 'run', images(), LENSES, moved, wrong)
    run = read_run(folder, Topics(camera_frame='/real_optical_frame'))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    assert not np.allclose(poses(read_run(folder))[0], POSES[0], atol=0.1)
    with pytest.raises(ConfigError, match='--camera-frame: not for sensor_msgs/msg/JointState'):
        read_run(bag(tmp_path / 'joints', images(), joints()), Topics(camera_frame='camera'))


def test_transforms_of_a_clock_that_began_again_are_refused_up_to_where_it_was(tmp_path):
    second = [(time + 20 * PERIOD, topic, tf_message(np.eye(4), 'object', 'tool0', stamp))
              for (time, topic, _), stamp in zip(transforms(mounted=False),
                                                 range(BEGIN, BEGIN + 9 * PERIOD, PERIOD),
                                                 strict=True)]
    run = read_run(bag(tmp_path / 'run', images(), LENSES, transforms(), second))
    np.testing.assert_allclose(poses(run), POSES, atol=1e-9)
    assert run.counters['bag']['refused/unusable_transform'] == 9


def test_a_camera_at_the_objects_centre_is_refused(tmp_path):
    folder = bag(tmp_path / 'run', images(), LENSES, transforms())
    with pytest.raises(DataError, match="at the object's centre, which --object-frame and"):
        read_run(folder, Topics(object_frame='camera'))
    with pytest.raises(DataError, match="at the object's centre"):
        read_run(bag(tmp_path / 'poses', images(), list(cameras())[:2]),
                 scene=Scene(object_position=POSES[0][:3, 3]))


def test_joints_that_cannot_be_used_are_refused_with_what_the_transforms_lack(tmp_path):
    arm = joints(topic='/joint_states', names=('shoulder', 'elbow'))
    folder = bag(tmp_path / 'run', images(), LENSES, arm, transforms('base_link'))
    with pytest.raises(DataError, match="with --joint. The transforms have no frame 'object'; "
                                        'there are base_link, camera, tool0: name the'):
        read_run(folder)
    one = bag(tmp_path / 'one', images(), joints(), transforms('base_link'))
    with pytest.raises(ConfigError, match="--object-frame: not for .*no frame 'bse_link'"):
        read_run(one, Topics(object_frame='bse_link'))


def test_static_transforms_alone_are_one_view(tmp_path):
    fixed = [(BEGIN, '/tf_static', tf_message(POSES[0], 'object', 'camera', BEGIN))]
    run = read_run(bag(tmp_path / 'run', images(), LENSES, fixed))
    np.testing.assert_allclose(poses(run), POSES[:1], atol=1e-9)


def test_options_for_other_bags_are_refused(tmp_path):
    folder = bag(tmp_path / 'run', images(), LENSES, transforms())
    with pytest.raises(ConfigError, match='--turned-object: not for tf2_msgs'):
        read_run(folder, Topics(turned_object=True))
    with pytest.raises(ConfigError, match='--camera-position: not needed'):
        read_run(folder, scene=replace(Scene(), camera_position=[1.0, 0, 1]))
    turntable = bag(tmp_path / 'turntable', images(), joints())
    with pytest.raises(ConfigError, match='--object-position: not for azimuths'):
        read_run(turntable, scene=Scene(object_position=[1.0, 0, 1]))
