"""What is told beside other people's bags: sizes, where the camera stands, the background."""

import math

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.rebuilt import lacks_reconstruction, rebuilt
from active_recon.bags.runs.scene import parse_background, Scene
from active_recon.bags.runs.topics import Topics
from active_recon.calibration.placement import cube_corners
from active_recon.cli.main import app
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import CANONICAL_DISTANCE, CANONICAL_INTRINSICS
from active_recon.volumes.refinement import refined_mesh
from active_recon.volumes.voxels import VoxelGrid
import cv2
from foreign_recordings import AZIMUTHS, cameras, images, joints, TIMES
from loop_bags import header, write_bag
from msg_tools.images import image_to_msg
import numpy as np
import pytest
from typer.testing import CliRunner

pytestmark = pytest.mark.usefixtures('loaded_once')
BEHIND = np.full((24, 32, 3), (0, 177, 64), np.uint8)
SHOWN = BEHIND.copy()
SHOWN[6:18, 10:22] = (200, 30, 40)


def views(folder, messages, scene=None, **topics):
    run = read_run(write_bag(folder, sorted(messages, key=lambda entry: entry[0])),
                   Topics(**topics), scene or Scene())
    return run.episodes[0].views


def on_green():
    return [(time, '/cam/color', image_to_msg(SHOWN, header(time, 'camera')))
            for time, _ in TIMES]


def lens_alone():
    return [entry for entry in cameras() if entry[1] == '/info']


def test_a_camera_of_azimuths_alone_stands_as_far_as_the_object_is_large(tmp_path):
    found = views(tmp_path / 'run', images() + joints(),
                  Scene(object_size=0.16, elevation=math.radians(45)))
    assert [view.camera.azimuth for view in found] == pytest.approx(AZIMUTHS)
    for view in found:
        assert view.camera.distance == pytest.approx(0.16 * CANONICAL_DISTANCE)
        assert view.camera.elevation == pytest.approx(math.radians(45))


@pytest.mark.parametrize('turned', [False, True])
def test_a_camera_of_a_known_position_is_itself(tmp_path, turned):
    place = (0.0, 0.3, 0.4)
    found = views(tmp_path / 'run', images() + joints() + lens_alone(),
                  Scene(object_size=0.16, camera_position=place), turned_object=turned)
    sign = -1 if turned else 1
    assert [view.camera.azimuth for view in found] == pytest.approx(
        [(math.pi / 2 + sign * azimuth) % math.tau for azimuth in AZIMUTHS])
    assert found[0].camera.position == pytest.approx(place)
    assert found[0].camera.intrinsics.fx == pytest.approx(CANONICAL_INTRINSICS.fx * 32 / 137)
    pixel, _ = found[0].camera.project(np.zeros((1, 3)))
    assert pixel[0] == pytest.approx([found[0].camera.intrinsics.cx,
                                      found[0].camera.intrinsics.cy])


def test_a_camera_of_a_known_position_and_no_lens_sees_the_object_as_large_from_afar(tmp_path):
    folder = write_bag(tmp_path / 'run', [*images(), *joints()])
    corners = cube_corners(0.5)
    for distance in (0.8, 8.0):
        camera = read_run(folder, scene=Scene(
            object_size=0.5, camera_position=(0.0, distance, 0.0))).episodes[0].views[0].camera
        assert camera.distance == pytest.approx(distance)
        middle = camera.project(np.zeros((1, 3)))[0]
        across = np.abs(camera.project(corners * [1, 0, 1])[0] - middle).max()
        assert across == pytest.approx(
            CANONICAL_INTRINSICS.fx / CANONICAL_INTRINSICS.width * 24 / 2.1 / 2)


def test_a_background_is_taken_away_as_it_is_told(tmp_path):
    path = tmp_path / 'empty.png'
    cv2.imwrite(str(path), BEHIND[..., ::-1])
    for number, told in enumerate(('0,177,64', str(path))):
        how, empty = parse_background(told)
        found = views(tmp_path / str(number), on_green() + joints(),
                      Scene(background=how, empty_scene=empty))
        assert (found[0].image[0, 0] == 255).all()
        assert (found[0].image[12, 16] == (200, 30, 40)).all()
    how, nothing = parse_background('segment')
    found = views(tmp_path / 'segment', on_green() + joints(), Scene(background=how))
    assert nothing is None and (found[0].image[0, 0] == 255).all()
    assert np.abs(found[0].image[12, 16] - np.array((200, 30, 40))).max() < 40
    for wrong in ('grey', '0,300,64', str(tmp_path)):
        with pytest.raises(ConfigError):
            parse_background(wrong)


def test_what_the_bag_tells_cannot_be_told_otherwise(tmp_path):
    posed = [*images(), *cameras()]
    for number, scene in enumerate((Scene(elevation=0.5), Scene(camera_position=(1, 0, 1)))):
        with pytest.raises(ConfigError, match='the bag has camera poses on /tracker'):
            views(tmp_path / str(number), posed, scene)
    for topics in (Topics(joint='turn'), Topics(turned_object=True)):
        with pytest.raises(ConfigError, match='not for geometry_msgs/msg/PoseStamped'):
            read_run(tmp_path / '0', topics)
    with pytest.raises(ConfigError, match='both set the elevation'):
        Scene(elevation=0.5, camera_position=(1, 0, 1))
    with pytest.raises(ConfigError, match='needs --camera-position'):
        Scene(camera_orientation=(0, 0, 0, 1))


def told(*arguments):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return ' '.join(result.output.split())


def test_bag_info_tells_what_is_assumed_and_what_a_replay_still_needs(tmp_path):
    alone = write_bag(tmp_path / 'alone', sorted(images() + joints(), key=lambda each: each[0]))
    said = told('bag', 'info', alone)
    assert 'can be replayed' in said
    assert 'a side of 1 m (--object-size)' in said
    assert 'elevation 30 degrees (--elevation-deg or --camera-position)' in said
    assert 'the lens on /cam/color' in said
    near = write_bag(tmp_path / 'near', sorted([*images(), *cameras()], key=lambda each: each[0]))
    assert 'cannot be replayed' not in told('bag', 'info', near)
    said = told('bag', 'info', near, '--object-size', 9)
    assert 'cannot be replayed: view 1: ' in said
    assert '--object-size' in said
    assert '3 views at azimuths 0, 86, 172 degrees' in said  # what is there is told all the same


@pytest.mark.parametrize('command', ['bag info', 'replay', 'report', 'view'])
def test_every_command_that_reads_bags_has_the_same_options(command):
    said = told(*command.split(), '--help')
    for option in ('--image', '--azimuth', '--object-size', '--object-yaw-deg', '--elevation-deg',
                   '--camera-position', '--background'):
        assert option in said


def test_shapes_of_a_bag_that_holds_none_are_as_large_as_they_are_told(tmp_path):
    folder = write_bag(tmp_path / 'run', sorted(on_green() + joints(), key=lambda each: each[0]))
    scene = Scene(object_size=0.16)
    run, made_by = rebuilt(read_run(folder, scene=scene), scene)
    assert made_by.startswith('the weights ')
    assert not lacks_reconstruction(run)
    assert {view.reconstruction.size for view in run.episodes[0].views} == {0.16}
    assert rebuilt(run, scene) == (run, '')


def test_a_mesh_and_voxels_come_out_of_a_bag_without_any_record(tmp_path):
    import trimesh

    folder = write_bag(tmp_path / 'run', sorted(on_green() + joints(), key=lambda each: each[0]))
    mesh, voxels = tmp_path / 'out' / 'mug.ply', tmp_path / 'out' / 'mug.npz'
    said = told('replay', folder, '--object-size', 0.16, '--background', '0,177,64', '--mesh',
                mesh, '--voxels', voxels, '--threads', 1)
    assert f'wrote {mesh}' in said
    with np.load(voxels) as stored:
        occupancy, size = stored['occupancy'], float(stored['size'])
        expected = refined_mesh(VoxelGrid(occupancy, size), float(stored['threshold']))
    assert size == 0.16
    assert occupancy.max() <= 1
    surface = trimesh.load(mesh)
    assert len(surface.faces) == len(expected.faces)
    np.testing.assert_allclose(surface.bounds, expected.bounds, atol=1e-6)
    assert 0 < surface.extents.max() <= 0.17
    with pytest.raises(ConfigError, match='--mesh: unknown suffix: expected ply'):
        told('replay', folder, '--mesh', tmp_path / 'mug.png')
