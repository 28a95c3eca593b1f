"""Photographs in Middlebury's format are read as they were taken, and refused by file and line."""

import math
import os
from pathlib import Path

from active_recon.datasets.middlebury import MARGIN, read_photographs
from active_recon.errors import ActiveReconError, ConfigError, DataError
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.photographs import (
    BACKGROUNDS,
    even_views,
    hull,
    photograph_figures,
)
from active_recon.evaluation.posed.summary import markdown
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.models.carving import Carving
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
import pytest
import trimesh

DINO = Path(os.environ.get('ACTIVE_RECON_DINO')
            or Path(__file__).parents[2] / 'shared/data/photos/dino_sparse_ring')
LENS = Intrinsics(200, 210, 60.5, 50.5, 120, 100)
CENTRE, SIDE = np.array([0.2, -0.1, 0.05]), 0.5
EXTENTS = np.array([0.3, 0.5, 0.2]) / MARGIN
TO_OBJECT = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # the files' y is up


@pytest.fixture(scope='module')
def box():
    """Return a box in the frame `object`, whose cube has the side 1."""
    return trimesh.creation.box(EXTENTS[[0, 2, 1]] / SIDE)


def written(folder, box, views=8):
    """Write photographs of a box about CENTRE, in the files' own frame; return their cameras."""
    folder.mkdir(parents=True, exist_ok=True)
    renderer, lines, cameras = Renderer(box), [str(views)], []
    for view in range(views):
        camera = orbit_camera(view * 2 * math.pi / views, 0.2 + 0.1 * (view % 3), 2.6, LENS)
        image = composite(renderer.render(camera), 0)
        cv2.imwrite(str(folder / f'box{view}.png'), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
        rotation = camera.pose[:3, :3].T @ TO_OBJECT
        moved = -rotation @ (TO_OBJECT.T @ camera.position * SIDE + CENTRE)
        lens = [LENS.fx, 0, LENS.cx - 0.5, 0, LENS.fy, LENS.cy - 0.5, 0, 0, 1]
        lines.append(' '.join([f'box{view}.png',
                               *(f'{number:.9f}' for number in [*lens, *rotation.ravel(),
                                                                *moved])]))
        cameras.append(camera)
    (folder / 'box_par.txt').write_text('\n'.join(lines) + '\n')
    least, greatest = CENTRE - EXTENTS / 2, CENTRE + EXTENTS / 2
    corners = '\n'.join('({:.6f} {:.6f} {:.6f})'.format(*corner) for corner in (least, greatest))
    (folder / 'README.txt').write_text(f'The (tight) box is\n{corners}\n(or so)\n')
    return cameras


@pytest.fixture(scope='module')
def folder(tmp_path_factory, box):
    out = tmp_path_factory.mktemp('photos')
    written(out, box)
    return out


def test_cameras_stand_where_they_stood(folder, box, tmp_path):
    read = read_photographs(folder)
    assert len(read) == 8 and read.names[3] == 'box3.png'
    for own, true in zip(read.cameras, written(tmp_path, box), strict=True):
        np.testing.assert_allclose(own.pose, true.pose, atol=1e-5)
        assert own.intrinsics == LENS


def test_the_hull_of_all_silhouettes_is_about_the_object(folder, box):
    read, truth = read_photographs(folder), voxelise(box).occupied(0.5)
    carved = hull(read, range(8))
    assert (carved & truth).sum() > 0.9 * truth.sum()
    assert iou(carved, truth) > 0.6
    assert hull(read, [0]).sum() > hull(read, [0, 2]).sum() > carved.sum()


def test_a_box_that_is_given_is_taken(folder):
    least, greatest = CENTRE - EXTENTS / 2, CENTRE + EXTENTS / 2
    told, given = read_photographs(folder), read_photographs(folder, [*least, *greatest])
    np.testing.assert_allclose(told.cameras[2].pose, given.cameras[2].pose, atol=1e-5)
    wider = read_photographs(folder, [*(least - 0.1), *(greatest + 0.1)])
    assert wider.cameras[0].distance < given.cameras[0].distance


def test_masks_of_one_s_own_are_taken(folder, box, tmp_path):
    written(tmp_path, box)
    (tmp_path / 'masks').mkdir()
    mask = np.zeros((100, 120), np.uint8)
    mask[40:60] = 255
    cv2.imwrite(str(tmp_path / 'masks' / 'box1.png'), mask)
    read = read_photographs(tmp_path)
    np.testing.assert_array_equal(read.masks[1], mask > 0)
    np.testing.assert_array_equal(read.masks[2], read_photographs(folder).masks[2])


def test_views_of_a_ring_are_evenly_apart():
    assert even_views(16) == [0, 3, 6, 9, 12]
    assert even_views(16, 14, 4) == [14, 2, 6, 10]


def test_photographs_are_held_against_the_hull_before_three_backgrounds(folder):
    carving = Entrant('carving', Carving(0).eval(), {64: 0.5, 32: 0.5})
    figures = photograph_figures(read_photographs(folder), [carving], 3)
    black, white, clutter = (figures['models']['carving'][name] for name in BACKGROUNDS)
    assert figures['views'] == [0, 2, 5] and figures['cells'] > 100
    for found in (black, white):
        assert found['iou'][0] < found['iou'][2]
        # The hull's masks are grown by 3 pixels
        np.testing.assert_allclose(found['iou'], figures['hull']['iou'], atol=0.15)
    assert clutter['iou'][2] < white['iou'][2] - 0.2  # it knows plain backgrounds alone
    assert black['least'][2] <= black['mean'][2] <= black['greatest'][2]


def test_a_network_of_canonical_cameras_sees_no_photographs(folder, network):
    figures = photograph_figures(read_photographs(folder), [Entrant('paper', network, {32: 0.4})])
    assert not figures['models'] and 'paper' in figures['left_out']
    text = markdown({'command': 'study', 'photographs': figures})
    assert 'paper is left out' in text and "the silhouettes' hull" in text


@pytest.mark.parametrize(('line', 'expected'), [
    ('box0.png 1 2', 'line 2: not a camera: expected a name and 21 numbers'),
    ('box0.png ' + ' '.join('x' * 21), 'line 2: not a camera: expected a name and 21 numbers'),
    ('box0.png ' + ' '.join(['0'] * 21), 'line 2: invalid lens: expected focal lengths above 0'),
    ('box0.png 100 0 50 0 100 50 0 0 1 ' + ' '.join(['2'] * 12),
     'invalid rotation: expected an orthogonal matrix'),
    ('none.png ' + ' '.join(['1'] * 21),
     'none.png: no readable photograph: expected an image file, found no file'),
    ('', 'no cameras: expected a line for each image')])
def test_what_is_no_camera_is_refused_by_its_line(line, expected, box, tmp_path):
    written(tmp_path, box, 1)
    (tmp_path / 'box_par.txt').write_text(f'1\n{line}\n')
    with pytest.raises(DataError, match=expected):
        read_photographs(tmp_path)


def test_a_folder_without_cameras_or_box_is_refused(folder, box, tmp_path):
    with pytest.raises(DataError, match='no such folder: expected one of photographs'):
        read_photographs(tmp_path / 'nowhere')
    with pytest.raises(DataError, match=r'wrong number of camera files: expected one \*_par.txt'):
        read_photographs(tmp_path)
    written(tmp_path, box, 1)
    (tmp_path / 'README.txt').unlink()
    with pytest.raises(DataError, match='give them by --box'):
        read_photographs(tmp_path)
    for wrong in ([1, 2, 3], [0, 0, 0, 0, 1, 1], [0, 0, 0, 1, 1, math.nan]):
        with pytest.raises(ConfigError, match='box: invalid corners: expected six numbers'):
            read_photographs(tmp_path, wrong)
    with pytest.raises(ActiveReconError, match='not an axis: expected x, y or z'):
        read_photographs(folder, up='w')


def test_a_mask_of_another_size_is_refused(box, tmp_path):
    written(tmp_path, box, 1)
    (tmp_path / 'masks').mkdir()
    cv2.imwrite(str(tmp_path / 'masks' / 'box0.png'), np.zeros((5, 6), np.uint8))
    with pytest.raises(DataError, match='no mask of the right size: expected 120 x 100 pixels'):
        read_photographs(tmp_path)


@pytest.mark.skipif(not DINO.is_dir(), reason='needs dinoSparseRing of Middlebury: name it by '
                                             'ACTIVE_RECON_DINO')
def test_five_even_views_of_the_dinosaur_carve_most_of_the_hull():
    dino = read_photographs(DINO)
    assert len(dino) == 16 and all(camera.distance > 5 for camera in dino.cameras)
    assert all(0.15 < camera.elevation < 0.35 for camera in dino.cameras)
    whole, five = hull(dino, range(16)), hull(dino, even_views(16))
    assert 4000 < whole.sum() < 5500
    assert 0.65 < iou(five, whole) < 0.8
