"""R2N2's layout on disk: what was written is read, and what is broken is refused by its path."""

import math

from active_recon.datasets.layout import list_objects, ObjectFolder, write_object, write_voxels
from active_recon.errors import DataError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, orbit_camera
from active_recon.volumes.binvox import write_binvox
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
import pytest

RNG = np.random.default_rng(0)
IMAGES = RNG.integers(0, 256, (3, 20, 24, 4), np.uint8)
CAMERAS = [orbit_camera(azimuth, elevation, distance)
           for azimuth, elevation, distance in ((0.0, 0.5, 2.1), (1.0, 0.2, 1.5), (6.0, -0.1, 3))]
GRID = VoxelGrid((RNG.random((32, 32, 32)) > 0.5).astype(np.float32))


@pytest.fixture
def folder(tmp_path):
    folder = ObjectFolder(tmp_path, 'chair', 'one')
    write_object(folder, IMAGES, CAMERAS, GRID)
    return folder


def test_an_object_comes_back_as_it_was_written(folder):
    assert folder.complete
    np.testing.assert_array_equal([folder.image(index) for index in range(3)], IMAGES)
    np.testing.assert_array_equal(folder.voxels().occupancy, GRID.occupancy)
    for read, written in zip(folder.cameras(), CAMERAS, strict=True):
        np.testing.assert_allclose(read.pose, written.pose, atol=1e-7)


def test_azimuths_on_disk_run_clockwise_in_degrees(folder):
    rows = np.loadtxt(folder.images_folder / 'rendering_metadata.txt')
    np.testing.assert_allclose(rows[:, 0], [0, 360 - math.degrees(1), 360 - math.degrees(6)])
    np.testing.assert_allclose(rows[:, 1], np.degrees([0.5, 0.2, -0.1]))
    np.testing.assert_allclose(rows[:, 3] * 1.75, [2.1, 1.5, 3])


def test_the_azimuths_of_a_turntable_come_back_in_their_order(tmp_path):
    folder = ObjectFolder(tmp_path, 'chair', 'all')
    write_object(folder, IMAGES[:1].repeat(24, axis=0), list(map(orbit_camera, AZIMUTHS)), GRID)
    azimuths = [camera.azimuth for camera in folder.cameras()]
    np.testing.assert_allclose(azimuth_difference(azimuths, AZIMUTHS), 0, atol=1e-7)


def test_finer_voxels_stand_beside_and_are_read_where_asked_for(folder):
    fine = VoxelGrid((RNG.random((64, 64, 64)) > 0.5).astype(np.float32))
    with pytest.raises(DataError, match='expected voxels of 64 cells a side; .* with `--fine`'):
        folder.voxels(64)
    write_voxels(folder, fine)
    assert (folder.root / 'ShapeNetVox64/chair/one/model.binvox').is_file()
    np.testing.assert_array_equal(folder.voxels(64).occupancy, fine.occupancy)
    np.testing.assert_array_equal(folder.voxels().occupancy, GRID.occupancy)


def test_voxels_of_another_resolution_than_their_folder_s_are_refused(folder):
    write_binvox(GRID, folder.voxels_path(64))
    with pytest.raises(DataError, match=r'wrong resolution: expected 64 cells a side, got \(32, '
                       r'32, 32\)'):
        folder.voxels(64)


def test_files_stand_where_r2n2_has_them(folder):
    names = {str(path.relative_to(folder.root)) for path in folder.root.rglob('*.*')}
    rendering = 'ShapeNetRendering/chair/one/rendering'
    assert names == {'ShapeNetVox32/chair/one/model.binvox', *(f'{rendering}/{name}' for name in (
        '00.png', '01.png', '02.png', 'rendering_metadata.txt', 'renderings.txt'))}


def test_an_object_without_voxels_is_not_complete(folder):
    folder.voxels_path().unlink()
    assert not folder.complete
    assert list_objects(folder.root) == [folder]


def test_objects_are_listed_by_category_and_name(tmp_path):
    for category, name in (('b', '1'), ('a', '2'), ('a', '1')):
        write_object(ObjectFolder(tmp_path, category, name), IMAGES, CAMERAS, GRID)
    found = [(folder.category, folder.name) for folder in list_objects(tmp_path)]
    assert found == [('a', '1'), ('a', '2'), ('b', '1')]


def test_a_folder_in_another_layout_is_refused(tmp_path):
    with pytest.raises(DataError, match='has no folder ShapeNetRendering; make one with'):
        list_objects(tmp_path)


@pytest.mark.parametrize('content', [
    b'', b'1 2 3 4\n', b'1 2 0 1 25\n1 2 0\n', b'one two 0 1 25\n', b'nan 30 0 1.2 25\n',
    b'0 30 0 0 25\n', b'0 90 0 1.2 25\n', b'\xff\xfe\n'])
def test_metadata_that_tells_no_cameras_is_refused(content, folder):
    (folder.images_folder / 'rendering_metadata.txt').write_bytes(content)
    with pytest.raises(DataError, match='rendering_metadata.txt: no readable cameras: expected '
                       'rows of five numbers'):
        folder.cameras()


def test_missing_metadata_is_refused(folder):
    (folder.images_folder / 'rendering_metadata.txt').unlink()
    with pytest.raises(DataError, match='No such file'):
        folder.cameras()


@pytest.mark.parametrize('picture', [
    np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint16)])
def test_an_image_that_is_not_rgba_of_eight_bits_is_refused(picture, folder):
    cv2.imwrite(str(folder.images_folder / '00.png'), picture)
    with pytest.raises(DataError, match='00.png: wrong image format: expected four channels .* of '
                       '8 bits'):
        folder.image(0)


def test_a_missing_or_broken_image_is_refused(folder):
    with pytest.raises(DataError, match='03.png: no readable image: expected a PNG, found no '
                       'file'):
        folder.image(3)
    (folder.images_folder / '00.png').write_bytes(b'\x89PNG\r\n')
    with pytest.raises(DataError, match='00.png: no readable image: expected a PNG, found no '
                       'whole PNG'):
        folder.image(0)


def test_an_image_that_cannot_be_written_leaves_the_object_incomplete(tmp_path):
    folder = ObjectFolder(tmp_path, 'chair', 'one')
    (folder.images_folder / '01.png').mkdir(parents=True)
    with pytest.raises(DataError, match='01.png: cannot be written'):
        write_object(folder, IMAGES, CAMERAS, GRID)
    assert not folder.complete


def test_an_object_that_is_rendered_into_another_folder_is_still_the_same(folder, tmp_path):
    elsewhere = ObjectFolder(tmp_path / 'other', folder.category, folder.name)
    write_object(elsewhere, IMAGES[:1], CAMERAS[:1], GRID)
    assert folder.is_copy_of(elsewhere) and folder.is_copy_of(folder)


def test_other_names_and_other_voxels_are_other_objects(folder, tmp_path):
    twin = ObjectFolder(tmp_path, folder.category, 'two')
    write_object(twin, IMAGES, CAMERAS, GRID)
    namesake = ObjectFolder(tmp_path / 'other', folder.category, folder.name)
    write_object(namesake, IMAGES, CAMERAS, VoxelGrid(1 - GRID.occupancy))
    unfinished = ObjectFolder(tmp_path / 'third', folder.category, folder.name)
    assert not any(map(folder.is_copy_of, (twin, namesake, unfinished)))
