"""Contact sheets: what is drawn stands where it should, and the command writes it."""

from active_recon.cli.main import app
from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import DataError
from active_recon.volumes.sheet import contact_sheet, sequence_sheet
from command_line import refusal as refused
import cv2
import numpy as np
import pytest
import torch
import trimesh
from typer.testing import CliRunner


def run(*arguments):
    """Run the command in this process; what the package refuses is raised."""
    result = CliRunner().invoke(app, ['sheet', *map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def test_a_sequence_is_a_row_of_its_views():
    images = torch.rand(3, 2, 3, 8, 8)
    sheet = sequence_sheet(images)
    assert sheet.shape == (16, 24, 3)
    for t in range(3):
        for b in range(2):
            tile = sheet[b * 8:b * 8 + 8, t * 8:t * 8 + 8]
            np.testing.assert_allclose(tile / 255, images[t, b].permute(1, 2, 0), atol=0.51 / 255)


def test_objects_stand_row_by_row_and_what_is_left_over_is_background():
    sheet = contact_sheet([trimesh.creation.box((1, 1, 1))] * 3, columns=2, tile=20)
    assert sheet.shape == (40, 40, 3)
    dark = (sheet < 255).any(axis=2).reshape(2, 20, 2, 20).any(axis=(1, 3))
    assert dark.tolist() == [[True, True], [True, False]]


def test_the_command_draws_a_category(tmp_path):
    run(tmp_path / 'lamps.png', '--category', 'lamp', '--count', 2)
    assert cv2.imread(str(tmp_path / 'lamps.png')).shape == (160, 8 * 160, 3)


def test_the_command_draws_a_folder_of_meshes_as_macos_leaves_it(tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / 'a.stl')
    (tmp_path / '._a.stl').write_bytes(b'\0\5\x16\7')
    assert run(tmp_path / 'sheet.png', '--meshes', tmp_path).exit_code == 0


@pytest.mark.parametrize(('model', 'side'), [('lifting', 128), ('2d3d-attention', 64)])
def test_training_images_are_those_of_the_network(dataset, tmp_path, model, side):
    path = tmp_path / 'new' / 'batch.png'
    run(path, '--training', dataset, '--count', 3, '--model', model)
    assert cv2.imread(str(path)).shape == (3 * side, 8 * side, 3)


def test_training_images_of_any_cameras_are_shown(tmp_path):
    list(make_dataset(shape_jobs('lamp', range(2), tmp_path / 'any'), 1,
                      viewing=Viewing('any', 3)))
    run(tmp_path / 'batch.png', '--training', tmp_path / 'any', '--count', 2)
    assert cv2.imread(str(tmp_path / 'batch.png')).shape == (2 * 128, 3 * 128, 3)
    with pytest.raises(DataError, match='expected 24, got 3'):
        run(tmp_path / 'batch.png', '--training', tmp_path / 'any', '--model', '2d3d')


def test_one_thing_is_shown(tmp_path, monkeypatch, capsys):
    line = refused(monkeypatch, capsys, 'sheet', tmp_path / 'x.png', '--category', 'chair',
                   '--training', tmp_path)
    assert 'expected one of --category, --meshes, --training, got --category and --t' in line


def test_training_images_are_those_of_a_dataset(tmp_path, monkeypatch, capsys):
    line = refused(monkeypatch, capsys, 'sheet', tmp_path / 'x.png', '--model', 'lifting')
    assert '--model without --training' in line


@pytest.mark.parametrize(('shown', 'option'), [('--training', '--azimuth-deg'),
                                                ('--meshes', '--count')])
def test_an_option_that_changes_nothing_of_what_is_shown_is_refused(
        shown, option, tmp_path, monkeypatch, capsys):
    line = refused(monkeypatch, capsys, 'sheet', tmp_path / 'x.png', shown, tmp_path, option, 3)
    assert f'{option} with {shown}' in line and 'no effect there' in line


def test_a_folder_without_meshes_or_objects_is_refused(tmp_path):
    with pytest.raises(DataError, match='no mesh files: expected some'):
        run(tmp_path / 'none.png', '--meshes', tmp_path)
    with pytest.raises(DataError, match='has no folder ShapeNetRendering'):
        run(tmp_path / 'none.png', '--training', tmp_path)


def test_a_sheet_is_a_png_file_or_refused_before_it_is_drawn(tmp_path, monkeypatch, capsys):
    for name in ('sheet.xyz', 'sheet'):
        line = refused(monkeypatch, capsys, 'sheet', tmp_path / name, '--category', 'chair')
        assert f'{name}: no PNG file' in line


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path, monkeypatch, capsys):
    (tmp_path / 'file').touch()
    line = refused(monkeypatch, capsys, 'sheet', tmp_path / 'file/x.png', '--category', 'chair',
                   '--count', 1)
    assert 'file' in line
