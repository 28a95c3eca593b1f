"""A manifest of models: its rows, and how each stands."""

import csv

from active_recon.datasets.making import make_object
from active_recon.datasets.manifest import EXPLICIT, manifest_jobs, read_manifest
from active_recon.errors import DataError
import numpy as np
import pytest
import trimesh

ROW = {'category': 'chair', 'file': 'chair/one.ply', 'split': 'train', 'source': 'someone',
       'licence': 'CC0-1.0', 'licence_evidence': EXPLICIT, 'front_axis': '+Z (by eye)',
       'sha256': '0123abcd'}
# y up, and its thick end at +z
CONE = trimesh.creation.cone(0.3, 1).apply_translation([0, 0, -0.5]).apply_transform(
    trimesh.transformations.rotation_matrix(np.pi, [0, 1, 0]))


def write(folder, *rows):
    path = folder / 'manifest.csv'
    with path.open('w', newline='') as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    return path


def test_a_row_tells_its_file_and_its_front(tmp_path):
    rows = read_manifest(write(tmp_path, ROW, {**ROW, 'front_axis': '+X muzzle'},
                               {**ROW, 'front_axis': 'unknown'}))
    assert [row.front for row in rows] == ['z', 'x', None]
    assert rows[0].file == tmp_path / 'chair/one.ply'


def test_a_manifest_of_a_spreadsheet_begins_with_the_mark_of_utf_8(tmp_path):
    path = write(tmp_path, {**ROW, 'source': 'Zoë'})
    plain = read_manifest(path)
    path.write_bytes(b'\xef\xbb\xbf' + path.read_bytes())
    assert read_manifest(path) == plain


def test_a_known_front_is_turned_to_plus_x(tmp_path):
    (tmp_path / 'chair').mkdir()
    CONE.export(tmp_path / 'chair/one.ply')
    (job,) = manifest_jobs(read_manifest(write(tmp_path, ROW)), tmp_path)
    assert (job.folder.category, job.folder.name) == ('chair', 'one')
    assert job.make_mesh().center_mass[0] > 0.1


def test_a_front_at_the_back_of_an_axis_is_known_too(tmp_path):
    (tmp_path / 'chair').mkdir()
    CONE.export(tmp_path / 'chair/one.ply')
    for axis, direction in (('-Z', [-1, 0]), ('+X', [0, -1]), ('-X (by eye)', [0, 1])):
        (job,) = manifest_jobs(read_manifest(write(tmp_path, {**ROW, 'front_axis': axis})),
                               tmp_path)
        # The thick end is at the file's +z
        assert job.make_mesh().center_mass[:2] @ direction > 0.1


def test_an_unknown_front_stands_at_a_yaw_that_the_file_s_hash_draws(tmp_path):
    (tmp_path / 'chair').mkdir()
    CONE.export(tmp_path / 'chair/one.ply')
    unknown = {**ROW, 'front_axis': 'unknown'}
    one, same, other = manifest_jobs(read_manifest(write(
        tmp_path, unknown, unknown, {**unknown, 'sha256': 'ffff'})), tmp_path)
    np.testing.assert_array_equal(one.make_mesh().vertices, same.make_mesh().vertices)
    assert not np.allclose(one.make_mesh().vertices, other.make_mesh().vertices)


def test_a_hash_in_capitals_is_one_and_a_manifest_may_have_no_rows(tmp_path):
    path = write(tmp_path, {**ROW, 'sha256': '0123ABCD'})
    assert read_manifest(path)[0].sha256 == '0123ABCD'
    path.write_text(path.read_text().splitlines()[0] + '\n')
    assert read_manifest(path) == []


def test_a_model_that_is_missing_is_refused_and_told(tmp_path):
    (job,) = manifest_jobs(read_manifest(write(tmp_path, ROW)), tmp_path)
    assert 'no such mesh file' in make_object(job, samples=1).refusal


@pytest.mark.parametrize('content', [
    b'', b'category,file\nchair,one.ply\n', b'\xff\xfe\x00\x00\n\xff\n',
    b','.join(name.encode() for name in ROW) + b'\nchair,one.ply\n',
    b','.join(name.encode() for name in ROW) + b'\na,b.ply,train,me,CC0,none,+Z,no hash\n'])
def test_what_is_no_manifest_is_refused(content, tmp_path):
    path = tmp_path / 'manifest.csv'
    path.write_bytes(content)
    with pytest.raises(DataError, match='manifest.csv: '):
        read_manifest(path)


@pytest.mark.parametrize('category', ['', '.', 'furniture/chair', '/chair', 'chair/'])
def test_a_category_that_cannot_name_one_folder_is_refused(category, tmp_path):
    with pytest.raises(DataError, match='a category that can name a folder .* in line 2'):
        read_manifest(write(tmp_path, {**ROW, 'category': category}))


def test_a_missing_manifest_is_refused(tmp_path):
    with pytest.raises(DataError, match='No such file'):
        read_manifest(tmp_path / 'manifest.csv')
