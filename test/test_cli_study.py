"""`active-recon study`, from the command line to the files that it writes."""

import json
from shutil import copytree

from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from command_line import command, refusal
import cv2
import pytest
import torch


@pytest.fixture(autouse=True)
def as_many_threads_as_before():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Return a folder of two lamps seen by any three cameras each."""
    out = tmp_path_factory.mktemp('lamps')
    list(make_dataset(shape_jobs('lamp', range(2), out), 1, fine=True, viewing=Viewing('any', 3)))
    return out


def test_a_study_writes_figures_a_table_and_a_picture(made, dataset, tmp_path, monkeypatch,
                                                      capsys):
    (tmp_path / 'study-0-earlier.png').touch()
    assert command(monkeypatch, 'study', made, dataset, '--models', 'carving,2d3d-attention',
                   '--counts', '1,3', '--surfaces', '', '--disturbed-views', 0, '--training', made,
                   '--threads', 1, '--out', tmp_path) == 0
    result = json.loads((tmp_path / 'study.json').read_text())
    assert "--surfaces ''" in result['command']
    posed, turntable = result['sets']
    assert list(posed['models']) == ['carving']
    assert list(turntable['models']) == ['carving', '2d3d-attention']
    assert len(posed['models']['carving']['random']['iou_64']) == 2
    assert posed['baselines']['nearest training image']['iou_64']['mean'] == 1
    assert '2d3d-attention is left out' in (tmp_path / 'study.md').read_text()
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith('wrote ')]
    pictures = sorted(tmp_path.glob('study-*.png'))[1:]
    assert told == [f'wrote {path}' for path in (
        tmp_path / 'study.json', tmp_path / 'study.md', *pictures)]
    assert len(pictures) == 2 and all(cv2.imread(str(path)) is not None for path in pictures)


def test_without_fine_voxels_nothing_is_left_blank_and_what_lacks_is_told(
        dataset, tmp_path, monkeypatch):
    assert command(monkeypatch, 'study', dataset, '--models', 'carving,2d3d-attention', '--counts',
                   1, '--surfaces', '', '--disturbed-views', 0, '--threads', 1, '--out',
                   tmp_path) == 0
    picture = cv2.imread(str(next(tmp_path.glob('study-*.png'))), cv2.IMREAD_GRAYSCALE)
    edge = picture.shape[1] // 4
    assert (picture[:, :edge] < 128).any() and (picture[:, -edge:] < 128).any()
    assert ('Without thin parts, precision, recall and calibration: carving. They are measured at '
            'the finest true voxels, 32 cells a side (`--fine` makes 64), of networks with as '
            'many.') in (tmp_path / 'study.md').read_text()


def test_numbers_of_views_that_objects_lack_are_named(made, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, 'study', made, '--models', 'carving', '--counts', '1,3,5,8',
                   '--surfaces', '', '--disturbed-views', 0, '--threads', 1, '--out',
                   tmp_path) == 0
    told = capsys.readouterr().err
    assert f'{made}: not measured after 5, 8 views: its objects have 3\n' in told


@pytest.mark.parametrize('asked', [
    ('study', '--models', 'carving', '--counts', 1, '--disturbed-views', 0),
    ('policies', '--model', 'carving', '--policies', 'uniform', '--views', 2)])
def test_objects_that_cannot_be_read_are_named(made, tmp_path, monkeypatch, capsys, asked):
    last = list_objects(copytree(made, tmp_path / 'some lamps'))[-1]
    (last.images_folder / '01.png').write_bytes(b'')
    assert command(monkeypatch, *asked, tmp_path / 'some lamps', '--threads', 1, '--out',
                   tmp_path) == 0
    told = capsys.readouterr().err
    assert f'left out: {last.images_folder / "01.png"}: no readable image' in told
    assert 'some lamps: 1 read, 0 missing, 1 left out\n' in told


@pytest.mark.slow
def test_training_objects_that_cannot_be_read_are_named(made, tmp_path, monkeypatch, capsys):
    last = list_objects(copytree(made, tmp_path / 'known'))[-1]
    (last.images_folder / '01.png').write_bytes(b'')
    assert command(monkeypatch, 'study', made, '--models', 'carving', '--counts', 1, '--training',
                   tmp_path / 'known', '--disturbed-views', 0, '--threads', 1, '--out',
                   tmp_path) == 0
    told = capsys.readouterr().err
    assert f'left out: {last.images_folder / "01.png"}: no readable image' in told
    assert 'training images: 1 read, 0 missing, 1 left out\n' in told


@pytest.mark.parametrize('asked', [
    ('study', 'none', '--models', 'carving'), ('study', '--photos', 'none', '--models', 'carving'),
    ('study', 'made', '--models', 'carving', '--validation', 'none'),
    ('study', 'made', '--models', 'carving', '--training', 'none'),
    ('study', 'made', '--models', 'carving', '--category', 'ship'),
    ('policies', 'made', 'none', '--model', 'carving', '--policies', 'uniform')])
def test_where_objects_are_missing_no_folder_is_made(made, tmp_path, monkeypatch, capsys, asked):
    places = {'made': made, 'none': tmp_path / 'none'}
    refusal(monkeypatch, capsys, *(places.get(part, part) for part in asked), '--threads', 1,
            '--out', tmp_path / 'out')
    assert not (tmp_path / 'out').exists()


def test_what_cannot_be_measured_is_refused_in_one_line(made, tmp_path, monkeypatch, capsys):
    def refused(*arguments):
        return refusal(monkeypatch, capsys, 'study', *arguments, '--out', tmp_path)

    assert 'got neither' in refused()
    assert 'whole numbers' in refused(made, '--counts', '1,two')
    assert 'surfaces: not measured: expected numbers of views out of --counts 1,3, got 1,5' in (
        refused(made, '--counts', '1,3', '--surfaces', '1,5'))
    assert 'got none' in refused(made, '--models', ',')
    assert 'same objects twice: expected other objects than those measured' in refused(
        made, '--models', 'carving', '--validation', made)
    assert "R2N2's layout" in refused(tmp_path, '--models', 'carving')
    assert '--up without --photos' in refused(made, '--models', 'carving', '--up', 'z')
    assert '--counts, --objects with --photos alone: no effect there' in refused(
        '--photos', tmp_path, '--models', 'carving', '--counts', 1, '--objects', 2)
    assert '_par.txt' in refused('--photos', tmp_path, '--models', 'carving')
    assert 'box: invalid corners: expected six numbers' in refused(
        '--photos', tmp_path, '--box', '1 a', '--models', 'carving')
