"""Meshes to a dataset: every job once, what is there kept, what cannot be read told."""

from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.making import (
    make_dataset,
    make_object,
    mesh_files,
    mesh_jobs,
    shape_jobs,
    yawed,
)
from active_recon.errors import ConfigError, DataError
from active_recon.volumes.rendering import Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
import trimesh

BOX = trimesh.creation.box((1, 0.5, 0.25))


def names(jobs):
    return [(job.folder.category, job.folder.name) for job in jobs]


def save(folder, *names, mesh=BOX):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        mesh.export(path)


def test_a_folder_s_meshes_are_named_by_category_and_file(tmp_path):
    save(tmp_path, 'chair/b.ply', 'chair/a.obj', 'car/a.stl')
    (tmp_path / 'car/notes.txt').write_text('no mesh')
    assert names(mesh_jobs(tmp_path, tmp_path, None, None)) == [
        ('car', 'a'), ('chair', 'a'), ('chair', 'b')]


def test_what_macos_puts_beside_a_mesh_is_none(tmp_path):
    save(tmp_path, 'chair/a.obj')
    (tmp_path / 'chair' / '._a.obj').write_bytes(b'\0\5\x16\7')
    assert mesh_files(tmp_path) == [tmp_path / 'chair' / 'a.obj']
    assert names(mesh_jobs(tmp_path, tmp_path, None, None)) == [('chair', 'a')]


def test_one_file_and_a_folder_of_files_are_of_their_folder_s_category(tmp_path):
    save(tmp_path, 'chair/a.obj')
    assert names(mesh_jobs(tmp_path / 'chair/a.obj', tmp_path, None, None)) == [('chair', 'a')]
    assert names(mesh_jobs(tmp_path / 'chair', tmp_path, None, None)) == [('chair', 'a')]


def test_meshes_of_one_name_bear_their_suffixes(tmp_path):
    save(tmp_path, 'chair/a.obj', 'chair/a.stl', 'chair/b.stl')
    jobs = mesh_jobs(tmp_path, tmp_path / 'out', None, None)
    assert names(jobs) == [('chair', 'a.obj'), ('chair', 'a.stl'), ('chair', 'b')]
    assert all(not outcome.refusal for outcome in make_dataset(jobs, samples=1))
    assert all(job.folder.complete for job in jobs)


def test_a_mesh_that_lies_deeper_bears_the_folders_between(tmp_path):
    save(tmp_path, 'chair/1a/models/model.obj', 'chair/2b/models/model.obj')
    assert names(mesh_jobs(tmp_path, tmp_path, None, None)) == [
        ('chair', '1a-models-model'), ('chair', '2b-models-model')]


def test_two_meshes_that_would_become_one_object_are_refused(tmp_path):
    save(tmp_path, 'chair/a-b.obj', 'chair/a/b.obj')
    with pytest.raises(DataError, match=r'got 2 meshes for chair/a-b\.obj; rename'):
        next(make_dataset(mesh_jobs(tmp_path, tmp_path, None, None)))


def test_bad_axes_and_folders_without_meshes_are_refused_before_the_work(tmp_path):
    with pytest.raises(DataError, match='none: no such file or folder: expected a mesh file'):
        mesh_jobs(tmp_path / 'none', tmp_path, None, None)
    with pytest.raises(DataError, match='no meshes there: expected files .*found none'):
        mesh_jobs(tmp_path, tmp_path, None, None)
    save(tmp_path, 'chair/a.obj')
    with pytest.raises(ConfigError, match="up: not an axis: .*got 'w'"):
        mesh_jobs(tmp_path, tmp_path, 'w', None)
    with pytest.raises(ConfigError, match="unknown category: expected one of .*'castle'"):
        shape_jobs('castle', range(2), tmp_path)


def test_an_object_is_rendered_from_24_azimuths_and_voxelised(tmp_path):
    (job,) = shape_jobs('lamp', [7], tmp_path)
    assert not make_object(job, samples=1).refusal
    mesh = job.make_mesh()
    cameras = job.folder.cameras()
    assert len(cameras) == 24
    for index in (0, 5):
        np.testing.assert_array_equal(
            job.folder.image(index), Renderer(mesh).render(cameras[index], samples=1))
    np.testing.assert_array_equal(job.folder.voxels().occupancy, voxelise(mesh).occupancy)


def test_what_is_there_is_not_made_again_and_what_was_broken_off_is(tmp_path):
    done, broken = shape_jobs('lamp', [7, 8], tmp_path)
    for job in (done, broken):
        make_object(job, samples=1)
    broken.folder.voxels_path().unlink()
    (broken.folder.images_folder / '20.png').unlink()
    (done.folder.images_folder / '20.png').unlink()
    assert len([*make_dataset([done, broken], samples=1)]) == 2
    assert broken.folder.complete
    assert (broken.folder.images_folder / '20.png').is_file()
    assert not (done.folder.images_folder / '20.png').is_file()


def test_fine_voxels_are_made_where_asked_for(tmp_path):
    (job,) = shape_jobs('lamp', [7], tmp_path)
    assert not make_object(job, samples=1, fine=True).refusal
    mesh = job.make_mesh()
    np.testing.assert_array_equal(job.folder.voxels().occupancy, voxelise(mesh).occupancy)
    np.testing.assert_array_equal(job.folder.voxels(64).occupancy, voxelise(mesh, 64).occupancy)


def test_an_object_that_lacks_just_its_fine_voxels_gets_just_these(tmp_path):
    (job,) = shape_jobs('lamp', [7], tmp_path)
    make_object(job, samples=1)
    written = {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.*')}
    assert not make_object(job, samples=1, fine=True).refusal
    assert job.folder.voxels(64).occupancy.any()
    assert {path: path.stat().st_mtime_ns for path in written} == written


def test_what_cannot_be_read_or_written_is_told_and_the_rest_is_made(tmp_path):
    save(tmp_path / 'in', 'chair/good.obj', 'car/good.obj')
    (tmp_path / 'in/chair/bad.ply').write_text('no mesh')
    (tmp_path / 'out/ShapeNetRendering').mkdir(parents=True)
    (tmp_path / 'out/ShapeNetRendering/car').write_text('in the way')
    outcomes = [*make_dataset(mesh_jobs(tmp_path / 'in', tmp_path / 'out', None, None), 1)]
    refusals = {f'{outcome.folder.category}/{outcome.folder.name}': outcome.refusal
                for outcome in outcomes}
    assert refusals.pop('chair/good') == ''
    assert 'bad.ply: no mesh that can be read' in refusals.pop('chair/bad')
    assert 'Not a directory' in refusals.pop('car/good')
    assert not refusals


def test_a_sheet_that_the_first_camera_sees_from_its_edge_is_made(tmp_path):
    sheet = trimesh.Trimesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]],
                            [[0, 1, 2], [0, 2, 3]])
    save(tmp_path, 'other/sheet.ply', mesh=sheet)
    (job,) = mesh_jobs(tmp_path, tmp_path, None, None)
    assert not make_object(job, samples=1).refusal


def test_a_yaw_turns_counter_clockwise_and_the_object_still_fits():
    turned = yawed(trimesh.creation.cone(0.1, 1).apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])), np.pi / 2)
    np.testing.assert_allclose(turned.extents, [0.2, 1, 0.2], atol=0.01)
    assert turned.vertices[turned.vertices[:, 1].argmax(), 0] == pytest.approx(0, abs=1e-6)
    assert turned.center_mass[1] < 0  # the tip was at +x and is at +y now


def test_what_is_finished_under_other_options_is_refused_and_stays(tmp_path):
    save(tmp_path, *(f'meshes/it/{name}.obj' for name in 'abcdefgh'))
    turned = Viewing(turned=True)
    jobs = mesh_jobs(tmp_path / 'meshes', tmp_path / 'out', None, None)
    jobs = [job for job in jobs if turned.yaw(f'it/{job.folder.name}')][:2]
    for job in jobs:
        assert not make_object(job, samples=1, viewing=turned).refusal
    for job in jobs:
        assert 'finished as another shape' in make_object(job, samples=1, fine=True).refusal
        assert not job.folder.voxels_path(64).exists()
        assert not make_object(job, samples=1, fine=True, viewing=turned).refusal
        pooled = job.folder.voxels(64).occupancy.reshape(32, 2, 32, 2, 32, 2).max((1, 3, 5))
        assert iou(pooled > 0.5, job.folder.voxels().occupied(0.5)) > 0.98
        assert 'finished from other cameras: expected the 3 of' in make_object(
            job, samples=1, viewing=Viewing('any', 3)).refusal


def test_what_a_run_of_other_cameras_left_is_not_mixed_in(tmp_path):
    (job,) = shape_jobs('lamp', [7], tmp_path)
    make_object(job, samples=1, viewing=Viewing('any', 3))
    job.folder.voxels_path().unlink()
    assert not make_object(job, samples=1).refusal
    assert len(job.folder.cameras()) == 24
    assert job.folder.image(0).shape == (137, 137, 4)
