"""`active-recon calibrate`: images in, the parameters of the nodes out."""

import math
from shutil import copytree

from active_recon.calibration.lens import project, write_lens
from active_recon.cli.main import app
from active_recon.geometry.cameras import Camera
from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.parameters.params_file import read_params_file
import cv2
import numpy as np
import pytest
from recorded_messages import small_disk
from rendered_boards import BOARD, fixed_camera, LENS, on_table, render
from typer.testing import CliRunner
import yaml

STEP_DEG = 40
OPTIONS = ['--squares', f'{BOARD.columns}x{BOARD.rows}', '--object-size', '0.1']


def calibrate(*options):
    return CliRunner().invoke(app, ['calibrate', *map(str, options)])


def refusal(*options):
    result = calibrate(*options)
    assert result.exception is not None
    return str(result.exception)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder of a board on a table that turns clockwise, seen by a known lens."""
    folder = tmp_path_factory.mktemp('calibrate')
    (folder / 'images').mkdir()
    write_lens(LENS, folder / 'lens.yaml')
    for index in range(9):
        pose = np.linalg.inv(fixed_camera().pose) @ on_table(-math.radians(STEP_DEG * index))
        cv2.imwrite(str(folder / 'images' / f'table{index + 5}.png'), render(LENS, pose))
    return folder


@pytest.fixture(scope='module')
def written(folder):
    """Return the parameters that were written, and what was said."""
    result = calibrate(folder / 'images', *OPTIONS, '--step-deg', STEP_DEG, '--camera-info',
                       folder / 'lens.yaml', '--out', folder / 'out')
    assert result.exit_code == 0, result.output
    return yaml.safe_load((folder / 'out' / 'calibration.yaml').read_text()), result.output


def test_active_recon_up_can_use_the_parameters_that_are_written(written, folder):
    nodes, _ = written
    assert '/**/turntable_driver' in nodes
    assert list(read_params_file(folder / 'out' / 'calibration.yaml')) == [
        'reconstructor', 'view_planner']


def test_the_parameters_are_those_of_the_camera_beside_the_table(written):
    nodes, _ = written
    given = nodes['/**/reconstructor']['ros__parameters']
    assert given['object_size'] == 0.1
    assert given['pose_source'] == 'turntable_joint'
    assert given['turntable_direction'] == -1
    camera = Camera(FixedCamera.from_parameters(
        given['camera_position'], given['camera_orientation'], -1).pose_at_zero)
    x, y, z = fixed_camera().position
    assert camera.distance == pytest.approx(math.dist((x, y, z), (0, 0, 0.05)), abs=1e-3)
    assert camera.position[2] == pytest.approx(z - 0.05, abs=1e-3)
    goals = nodes['/**/view_planner']['ros__parameters']
    assert goals['distance'] == pytest.approx(camera.distance, abs=1e-4)
    assert goals['elevation'] == pytest.approx(camera.elevation, abs=1e-4)
    assert nodes['/**/turntable_driver']['ros__parameters'] == {
        'camera_azimuth_at_zero': 0.0, 'turntable_direction': -1}


def test_every_image_and_its_error_is_told(written, folder):
    _, said = written
    for index in range(9):
        assert f'table{index + 5}.png: ' in said
    assert 'reprojection error 0.' in said
    head = (folder / 'out' / 'calibration.yaml').read_text().splitlines()[0]
    assert head.startswith('# Calibrated from 9 images, reprojection error 0.')


def test_the_picture_shows_the_axis_where_it_is(written, folder):
    picture = cv2.imread(str(folder / 'out' / 'calibration.png'))
    assert picture.shape == (2 * 480, 3 * 640, 3)
    x, y = project(LENS, np.zeros((1, 3)), fixed_camera().object_to_camera)[0].astype(int)
    around = picture[y - 3:y + 4, x - 3:x + 4].astype(int)
    plain = render(LENS, np.linalg.inv(fixed_camera().pose) @ on_table(0.0))
    assert np.abs(around - plain[y - 3:y + 4, x - 3:x + 4]).max() > 60


def test_a_calibration_s_own_camera_info_can_be_given_again(written, folder):
    result = calibrate(folder / 'images', *OPTIONS, '--step-deg', STEP_DEG, '--camera-info',
                       folder / 'out' / 'camera_info.yaml', '--out', folder / 'again')
    assert result.exit_code == 0, result.output
    assert (folder / 'again' / 'calibration.yaml').read_text() == (
        folder / 'out' / 'calibration.yaml').read_text()


def test_a_calibration_that_finds_no_room_leaves_the_one_that_stood_there(
        written, folder, tmp_path):
    copytree(folder / 'out', tmp_path / 'out')
    with small_disk(50):
        said = refusal(folder / 'images', *OPTIONS, '--step-deg', STEP_DEG, '--camera-info',
                       folder / 'lens.yaml', '--out', tmp_path / 'out')
    assert 'out: calibration not written: ' in said
    assert {path.name: path.read_bytes() for path in (tmp_path / 'out').iterdir()} == {
        path.name: path.read_bytes() for path in (folder / 'out').iterdir()}


def test_angles_by_name_give_what_the_step_gives(written, folder):
    nodes, _ = written
    rows = [f'table{index + 5}.png, {STEP_DEG * index}\n' for index in range(9)]
    (folder / 'angles.csv').write_text('image, degrees\n' + ''.join(reversed(rows)))
    result = calibrate(folder / 'images', *OPTIONS, '--angles-deg', folder / 'angles.csv',
                       '--camera-info', folder / 'lens.yaml', '--out', folder / 'named')
    assert result.exit_code == 0, result.output
    assert yaml.safe_load((folder / 'named' / 'calibration.yaml').read_text()) == nodes


def test_without_angles_or_a_lens_it_says_what_is_not_known(folder):
    result = calibrate(folder / 'images', *OPTIONS, '--out', folder / 'bare')
    assert result.exit_code == 0, result.output
    assert "note: The direction of the turntable's angle is unknown" in result.output
    assert 'note: An ideal principal point and no lens distortion are assumed' in result.output
    given = yaml.safe_load((folder / 'bare' / 'calibration.yaml').read_text())
    assert 'turntable_direction' not in given['/**/reconstructor']['ros__parameters']


def test_a_step_that_is_wrong_is_refused(folder):
    said = refusal(folder / 'images', *OPTIONS, '--step-deg', 30, '--out', folder / 'wrong')
    assert 'check the angles or the step' in said
    assert not (folder / 'wrong').exists()


def test_another_board_than_was_told_is_refused(folder):
    said = refusal(folder / 'images', '--squares', '5x4', '--object-size', 0.1)
    assert 'give the number of squares by --squares' in said


def test_a_lens_of_other_images_is_refused(folder):
    text = (folder / 'lens.yaml').read_text()
    (folder / 'large.yaml').write_text(text.replace('image_width: 640', 'image_width: 1280'))
    said = refusal(folder / 'images', *OPTIONS, '--camera-info', folder / 'large.yaml')
    assert 'large.yaml: wrong image size: expected that of the other images, 640 x 480' in said


def test_the_board_to_print_comes_with_its_size(tmp_path):
    result = calibrate('--print-board', tmp_path / 'board.png', '--squares', '5x4',
                       '--square-mm', 25)
    assert result.exit_code == 0, result.output
    assert '5 x 4 squares are 125.0 x 100.0 mm' in result.output
    assert (tmp_path / 'board.png').is_file()


@pytest.mark.parametrize(('options', 'said'), [
    ([], 'no images of the board, or no --object-size'),
    (['--print-board', 'b.png', '--squares', '7by5'], "e.g. 7x5, got '7by5'"),
    (['images', '--object-size', 1, '--step-deg', 15, '--angles-deg', 'a.csv'],
     'give one of them'),
    (['images', '--object-size', 1, '--step-deg', 15, '--mount-frame', 'flange'],
     '--mount-frame without --poses'),
    (['nowhere', '--object-size', 1], 'nowhere'),
    (['images', '--object-size', 1, '--out', 'images/'], '--out: a folder of images, images'),
    (['images', '--object-size', 1, '--step-deg', 'nan'], '--step-deg: not finite'),
    (['images', '--object-size', 1, '--board-thickness-mm', 'inf'], 'board_thickness: not finite'),
    (['images', '--object-size', 1, '--camera-azimuth-deg', 'nan'], 'azimuth_at_zero: not finite'),
])
def test_options_that_cannot_be_or_do_not_go_together_are_refused(
        options, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'images').mkdir()
    (tmp_path / 'images' / 'one.png').touch()
    assert said in refusal(*options)


@pytest.mark.parametrize('square_mm', [0.05, 20000])
def test_a_board_of_metres_taken_for_millimetres_is_refused(square_mm, tmp_path):
    assert 'are they in millimetres?' in refusal(
        '--print-board', tmp_path / 'board.png', '--square-mm', square_mm)
    assert not any(tmp_path.iterdir())


def test_an_object_s_size_in_millimetres_is_refused(folder, tmp_path):
    line = refusal(folder / 'images', *OPTIONS[:3], 100, '--step-deg', STEP_DEG, '--camera-info',
                   folder / 'lens.yaml', '--out', tmp_path / 'out')
    assert "camera in the object's cube" in line and 'in metres?' in line
    assert not (tmp_path / 'out').exists()


def test_it_tells_how_far_it_is(written):
    assert 'searching the board: 9/9' in written[1]
