"""`active-recon render` and `active-recon dataset build`, as they are typed."""

import errno
from pathlib import Path
import subprocess
import sys

from active_recon.cli.main import app
from active_recon.datasets.layout import list_objects
from active_recon.errors import ConfigError, DataError
from active_recon.shapes import CATEGORIES, generators_hash, UNSEEN_CATEGORIES
from command_line import command, refusal
import pytest
import trimesh
from typer.testing import CliRunner

ONE_WORKER = ('--workers', '1', '--samples', '1')


def run(*arguments):
    """Run the command in this process; what the package refuses is raised."""
    result = CliRunner().invoke(app, list(map(str, arguments)))
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def meshes(tmp_path):
    for category, size in (('chair', (1, 1, 2)), ('table', (2, 2, 1))):
        folder = tmp_path / 'meshes' / category
        folder.mkdir(parents=True)
        trimesh.creation.box(size).export(folder / 'box.ply')
    return tmp_path / 'meshes'


def test_render_makes_every_mesh_and_says_how_many(meshes, tmp_path):
    result = run('render', meshes, tmp_path / 'out', *ONE_WORKER)
    assert result.exit_code == 0
    assert '2 of 2 objects made' in result.stdout
    objects = list_objects(tmp_path / 'out')
    assert [(folder.category, folder.complete) for folder in objects] == [
        ('chair', True), ('table', True)]


def test_render_lists_what_was_refused_and_why_and_goes_on(meshes, tmp_path):
    (meshes / 'chair' / 'bad.obj').write_text('no mesh')
    result = run('render', meshes, tmp_path / 'out', *ONE_WORKER)
    assert result.exit_code == 0
    assert '2 of 3 objects made' in result.stdout
    assert 'rejected: chair/bad: ' in result.stderr
    assert 'bad.obj: a mesh without faces' in result.stderr


def test_render_fails_where_nothing_could_be_read(tmp_path):
    (tmp_path / 'bad.obj').write_text('no mesh')
    result = run('render', tmp_path / 'bad.obj', tmp_path / 'out', *ONE_WORKER)
    assert result.exit_code == 2
    assert '0 of 1 objects made' in result.stdout


def test_render_does_not_make_again_what_is_there(meshes, tmp_path):
    run('render', meshes, tmp_path / 'out', *ONE_WORKER)
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / 'out').rglob('*.*')}
    trimesh.creation.box((1, 2, 1)).export(meshes / 'chair' / 'new.ply')
    told = run('render', meshes, tmp_path / 'out', '--up', 'x', '--front', 'z', *ONE_WORKER).stdout
    assert '3 of 3 objects made, 2 of them finished before, kept as they are' in told
    assert all(path.stat().st_mtime_ns == time for path, time in written.items())


def test_render_turns_files_by_their_axes(meshes, tmp_path):
    run('render', meshes, tmp_path / 'out', '--up', 'x', '--front', 'z', *ONE_WORKER)
    chair = list_objects(tmp_path / 'out')[0].voxels().occupied(0.5)
    lengths = [int(chair.any(axis=axes).sum()) for axes in ((1, 2), (0, 2), (0, 1))]
    assert lengths[0] == 32  # the long z of the file stands at x
    assert max(lengths[1:]) <= 18


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--up', 'w'], "up: not an axis: .*got 'w'"),
    (['--up', 'x'], 'on the same axis: expected two, got x and x'),
    (['--split', 'train'], 'no manifest: expected a manifest')])
def test_render_refuses_options_that_cannot_be_used(arguments, message, meshes, tmp_path):
    with pytest.raises(ConfigError, match=message):
        run('render', meshes, tmp_path / 'out', *arguments)


def test_render_takes_the_rows_of_a_manifest_that_are_asked_for(meshes, tmp_path):
    manifest = meshes / 'manifest.csv'
    columns = 'category,file,split,source,licence,licence_evidence,front_axis,sha256'
    manifest.write_text(f'{columns}\n'
                        'chair,chair/box.ply,train,a,CC0,explicit for the models,+Z,ab\n'
                        'table,table/box.ply,train,a,?,of the collection,+Z,cd\n'
                        'table,table/box.ply,val,a,?,of the collection,+Z,cd\n')
    asked = ('--split', 'train', '--explicit-licence')
    result = run('render', manifest, tmp_path / 'out', *asked, *ONE_WORKER)
    assert '1 of 1 objects made' in result.stdout
    assert [folder.category for folder in list_objects(tmp_path / 'out')] == ['chair']
    with pytest.raises(DataError, match='no objects to make: expected at least one'):
        run('render', manifest, tmp_path / 'out', '--split', 'tests')
    with pytest.raises(ConfigError, match='--up or --front with a manifest: expected neither'):
        run('render', manifest, tmp_path / 'out', '--up', 'y')


def test_dataset_makes_three_splits_that_share_no_object(tmp_path):
    counts = ('--train', 2, '--val', 1, '--test', 1)
    result = run('dataset', 'build', tmp_path, *counts, '--category', 'lamp', *ONE_WORKER)
    assert '4 of 4 objects made' in result.stdout
    names = {split: [folder.name for folder in list_objects(tmp_path / split)]
             for split in ('train', 'val', 'test')}
    assert [len(found) for found in names.values()] == [2, 1, 1]
    assert len(set(sum(names.values(), []))) == 4
    assert (tmp_path / 'generators.sha256').read_text().strip() == generators_hash()


def test_dataset_makes_every_category_unless_told(tmp_path):
    counts = ('--train', 0, '--val', 1, '--test', 0, '--unseen', 1)
    run('dataset', 'build', tmp_path, *counts, *ONE_WORKER)
    for split, expected in (('val', CATEGORIES), ('unseen', UNSEEN_CATEGORIES)):
        categories = tuple(folder.category for folder in list_objects(tmp_path / split))
        assert categories == expected


def test_dataset_keeps_unseen_categories_out_of_the_splits(tmp_path):
    asked = ('--category', 'bookshelf', '--unseen', 2, '--fine')
    result = run('dataset', 'build', tmp_path, *asked, *ONE_WORKER)
    assert '2 of 2 objects made' in result.stdout
    objects = list_objects(tmp_path / 'unseen')
    assert [folder.category for folder in objects] == ['bookshelf'] * 2
    assert all(folder.voxels(64).occupancy.any() for folder in objects)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['generators.sha256', 'unseen']


def test_the_same_seeds_make_the_same_files(tmp_path):
    asked = ('--category', 'lamp', '--train', 1, '--val', 0, '--test', 0, *ONE_WORKER)
    for name in ('one', 'two'):
        run('dataset', 'build', tmp_path / name, *asked)
    files = [path.relative_to(tmp_path / 'one') for path in (tmp_path / 'one').rglob('*.*')]
    assert len(files) == 28
    for file in files:
        assert (tmp_path / 'one' / file).read_bytes() == (tmp_path / 'two' / file).read_bytes()


def test_dataset_does_not_go_on_with_objects_of_other_generators(tmp_path):
    (tmp_path / 'generators.sha256').write_text('0123456789abcdef\n')
    with pytest.raises(DataError, match='shapes of other generators: .*choose another folder'):
        run('dataset', 'build', tmp_path, '--train', 1, '--val', 0, '--test', 0)


def test_dataset_goes_on_where_the_disk_was_full_at_its_start(tmp_path, monkeypatch):
    asked = ('dataset', 'build', tmp_path, '--category', 'lamp', '--train', 1, '--val', 0,
             '--test', 0, *ONE_WORKER)

    def without_room(path, text):
        path.touch()
        raise OSError(errno.ENOSPC, 'No space left on device')

    with monkeypatch.context() as patch, pytest.raises(OSError, match='No space left'):
        patch.setattr(Path, 'write_text', without_room)
        run(*asked)
    assert '1 of 1 objects made' in run(*asked).stdout


def test_dataset_refuses_what_is_no_category_and_what_leaves_nothing_to_make(tmp_path):
    with pytest.raises(ConfigError, match="unknown category: expected one of .*, got 'castle'"):
        run('dataset', 'build', tmp_path, '--category', 'castle')
    with pytest.raises(DataError, match='no objects to make: expected at least one'):
        run('dataset', 'build', tmp_path / 'out', '--train', 0, '--val', 0, '--test', 0,
            '--unseen', 0)
    assert not (tmp_path / 'out').exists()


def test_a_folder_that_cannot_be_written_is_told_before_objects_are_made(
        meshes, tmp_path, monkeypatch, capsys):
    (tmp_path / 'file').touch()
    for place in ('file', 'file/below'):
        for asked in (['render', meshes, tmp_path / place],
                      ['dataset', 'build', tmp_path / place, '--train', 1]):
            assert f'{place}: cannot be written: expected a folder that files can be' in refusal(
                monkeypatch, capsys, *asked)


def test_dataset_refuses_counts_of_splits_that_its_categories_are_never_in(tmp_path):
    none = ('--train', 0, '--val', 0, '--test', 0, '--unseen', 0)
    for category, split in (('lamp', 'unseen'), ('bed', 'train')):
        with pytest.raises(ConfigError, match=f'--{split} with .*{category}'):
            run('dataset', 'build', tmp_path / 'out', *none, f'--{split}', 1,
                '--category', category)
    assert not (tmp_path / 'out').exists()


def test_a_number_of_views_is_for_drawn_cameras_alone(meshes, tmp_path):
    for made in (('render', meshes, tmp_path / 'out'),
                 ('dataset', 'build', tmp_path / 'out', '--category', 'bed', '--unseen', 1)):
        with pytest.raises(ConfigError, match='--views without --cameras any'):
            run(*made, '--views', 3)
    assert not (tmp_path / 'out').exists()


@pytest.mark.slow
def test_two_processes_make_what_one_makes(meshes, tmp_path):
    result = subprocess.run(
        [sys.executable, '-m', 'active_recon.cli.main', 'render', meshes, tmp_path / 'two',
         '--workers', '2', '--samples', '1'],
        capture_output=True, text=True, timeout=600, check=False)
    assert result.returncode == 0, result.stderr
    run('render', meshes, tmp_path / 'one', *ONE_WORKER)
    files = sorted(path.relative_to(tmp_path / 'one') for path in (tmp_path / 'one').rglob('*.*'))
    assert len(files) == 2 * 27
    for file in files:
        assert (tmp_path / 'one' / file).read_bytes() == (tmp_path / 'two' / file).read_bytes()


def test_a_refusal_is_one_line_and_exit_code_2(tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, 'render', tmp_path / 'none', tmp_path / 'out') == 2
    assert capsys.readouterr().err == (
        f'active-recon: {tmp_path}/none: no such file or folder: expected a mesh file or a folder '
        'of <category>/<mesh>\n')
