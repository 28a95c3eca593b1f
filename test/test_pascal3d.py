"""PASCAL3D+ in its own form: boxes, viewpoints and CAD models become objects of one view."""

import json
import math
import re

from active_recon.datasets.pascal3d import list_photographs
from active_recon.datasets.photographs import read_photographs
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, orbit_camera
from active_recon.models.weights_files import PAPER_MODEL
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import numpy as np
from PIL import Image
import pytest
from scipy.io import savemat
import trimesh

AZIMUTH_DEG, ELEVATION_DEG = 50.0, 20.0
EMPTY = np.zeros((0, 0))


def cad_model():
    """Return a wedge that no turn maps onto itself: its front at -y, a fin to its left at +x."""
    body = trimesh.creation.box((0.5, 1, 0.3))
    fin = trimesh.creation.box((0.3, 0.2, 0.2)).apply_translation((0.4, 0.2, 0))
    nose = trimesh.creation.box((0.2, 0.2, 0.6)).apply_translation((0, -0.4, 0.2))
    return trimesh.util.concatenate([body, fin, nose])


def pascal3d_camera(azimuth, elevation, distance):
    """Return the camera of the annotations' own formulas, in the CAD model's frame."""
    center = distance * np.array([math.cos(elevation) * math.sin(azimuth),
                                  -math.cos(elevation) * math.cos(azimuth),
                                  math.sin(elevation)])
    forward = -center / distance
    right = np.array([math.cos(azimuth), math.sin(azimuth), 0])
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(forward, right), forward, center])
    return Camera(pose, CANONICAL_INTRINSICS.resized(400, 400))


def viewpoint(**changes):
    return {'azimuth': AZIMUTH_DEG, 'elevation': ELEVATION_DEG, 'distance': 5.0, 'theta': 0.0,
            'azimuth_coarse': 45.0, 'elevation_coarse': 15.0, **changes}


def annotated(**changes):
    return {'class': 'car', 'bbox': [[101.0, 51.0, 300.0, 200.0]], 'cad_index': 1,
            'viewpoint': viewpoint(), 'truncated': 0, 'occluded': 0, 'difficult': 0, **changes}


def annotate(root, name, *objects):
    """Write an annotation as the release has it: a structure with an array of structures."""
    fields = objects[0].keys()
    array = np.empty((1, len(objects)), [(field, object) for field in fields])
    for index, item in enumerate(objects):
        array[0, index] = tuple(item[field] for field in fields)
    path = root / 'Annotations' / f'{name}.mat'
    path.parent.mkdir(parents=True, exist_ok=True)
    savemat(path, {'record': {'filename': f'{path.stem}.jpg', 'objects': array}})
    return path


def photograph(root, name, picture):
    path = root / 'Images' / name
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path)
    return path


@pytest.fixture
def root(tmp_path):
    """Return a folder of one photograph: the CAD model itself, seen as the annotation says."""
    (tmp_path / 'CAD/car').mkdir(parents=True)
    cad_model().export(tmp_path / 'CAD/car/01.off')
    camera = pascal3d_camera(math.radians(AZIMUTH_DEG), math.radians(ELEVATION_DEG), 3.0)
    rgba = Renderer(cad_model()).render(camera)
    alpha = rgba[..., 3] > 127
    rows, columns = np.flatnonzero(alpha.any(axis=1)), np.flatnonzero(alpha.any(axis=0))
    box = [columns[0] + 1, rows[0] + 1, columns[-1] + 1, rows[-1] + 1]  # from 1, as in MATLAB
    photograph(tmp_path, 'car_imagenet/one.JPEG', composite(rgba, 255))
    annotate(tmp_path, 'car_imagenet/one', annotated(bbox=[np.array(box, float)]))
    return tmp_path


def read(root, *categories):
    return read_photographs(*list_photographs(root, categories))


def test_a_photograph_becomes_an_object_of_one_view(root):
    views = read(root)
    assert views.images.shape == (1, 1, 64, 64, 4)
    assert views.azimuths.shape == (1, 1)
    assert list(views.categories) == ['car']
    assert views.folders[0].name == 'car_imagenet/one/1'
    assert not views.unreadable


def test_its_voxels_are_those_of_the_cad_model_with_the_front_at_plus_x(root):
    views = read(root)
    mesh = load_mesh(root / 'CAD/car/01.off', 'z', '-y')
    np.testing.assert_array_equal(views.voxels[0], voxelise(mesh).occupied(0.5))
    x, _, z = views.voxels[0].nonzero().T
    assert x[z == z.max()].min() > 20  # the nose, at -y in the file
    assert read_photographs(*list_photographs(root), resolution=64).voxels.shape[1:] == (64,) * 3


def test_the_azimuth_keeps_its_sign(root):
    azimuth = read(root).azimuths[0, 0].item()
    assert azimuth == pytest.approx(math.radians(AZIMUTH_DEG))


def test_the_object_is_where_and_as_large_as_the_canonical_camera_shows_it(root):
    views = read(root)
    shown = (views.white(*np.zeros((2, 1), int))[0] < 0.9).all(dim=0).numpy()
    mesh = load_mesh(root / 'CAD/car/01.off', 'z', '-y')

    def outline(azimuth):
        camera = orbit_camera(azimuth, math.radians(ELEVATION_DEG))
        camera = Camera(camera.pose, camera.intrinsics.resized(64, 64))
        return Renderer(mesh).render(camera)[..., 3] > 127

    azimuth = views.azimuths[0, 0].item()
    assert iou(shown, outline(azimuth), (0, 1)) > 0.85
    for wrong in (-azimuth, azimuth + math.pi / 2, azimuth + math.pi):
        assert iou(shown, outline(wrong), (0, 1)) < 0.8


def test_what_is_outside_the_box_is_white(root):
    photograph(root, 'car_imagenet/one.JPEG', np.full((400, 400, 3), 60, np.uint8))
    annotate(root, 'car_imagenet/one', annotated())
    white = read(root).white(*np.zeros((2, 1), int))[0]
    assert set(white.unique().tolist()) == {np.float32(60 / 255).item(), 1.0}
    dark = white[0] < 1
    down, across = dark.any(1).sum().item(), dark.any(0).sum().item()
    assert across / down == pytest.approx(200 / 150, abs=0.1)  # the ratio of the box stays
    assert (white[:, 0] == 1).all()


def test_a_box_that_reaches_over_the_border_is_cut_there(root):
    annotate(root, 'car_imagenet/one', annotated(bbox=[[-20.0, 1.0, 500.0, 400.0]]))
    assert len(read(root)) == 1


def test_without_a_fine_viewpoint_the_coarse_one_counts(root):
    annotate(root, 'car_imagenet/one', annotated(viewpoint=viewpoint(azimuth=0.0, distance=0.0)))
    assert read(root).azimuths[0, 0].item() == pytest.approx(math.radians(45))
    coarse = {'azimuth_coarse': 350.0, 'elevation_coarse': 10.0}
    annotate(root, 'car_imagenet/one', annotated(viewpoint=coarse))
    assert read(root).azimuths[0, 0].item() == pytest.approx(math.radians(350))


def test_several_objects_of_an_image_are_several_items_and_other_classes_are_none(root):
    annotate(root, 'car_imagenet/one', annotated(), annotated(**{'class': 'person'}),
             annotated())
    views = read(root)
    assert [folder.name for folder in views.folders] == [
        'car_imagenet/one/1', 'car_imagenet/one/3']
    assert not views.unreadable


def test_classes_bear_the_names_of_our_categories_and_can_be_chosen(root):
    (root / 'CAD/tvmonitor').mkdir()
    cad_model().export(root / 'CAD/tvmonitor/01.off')
    annotate(root, 'tvmonitor_pascal/two', annotated(**{'class': 'tvmonitor'}))
    photograph(root, 'tvmonitor_pascal/two.jpg', np.full((400, 400, 3), 60, np.uint8))
    assert list(read(root).categories) == ['car', 'monitor']
    assert list(read(root, 'monitor').categories) == ['monitor']
    with pytest.raises(DataError, match='annotations: expected those of sofa, got those of car, '
                       'monitor'):
        list_photographs(root, ['sofa'])


@pytest.mark.parametrize(('changes', 'reason'), [
    ({'truncated': 1}, 'it is truncated'),
    ({'occluded': 1, 'difficult': 1}, 'it is occluded and difficult'),
    ({'viewpoint': EMPTY}, 'missing field: expected viewpoint, found none'),
    ({'viewpoint': {'px': 1.0}}, 'missing field: expected azimuth_coarse, found none'),
    ({'viewpoint': viewpoint(azimuth=math.nan)}, 'invalid viewpoint: expected finite angles'),
    ({'viewpoint': viewpoint(elevation=90.0)},
     r'invalid elevation: expected one within \+-90 degrees'),
    ({'bbox': [[5.0, 5.0, 2.0, 9.0]]}, 'invalid box: expected left, top, right, bottom'),
    ({'bbox': [[5.0, 5.0]]}, 'not enough values'),
    ({'bbox': [[900.0, 900.0, 950.0, 950.0]]},
     'box out of the image: expected one within 400 x 400'),
    ({'cad_index': EMPTY}, 'missing field: expected cad_index, found none'),
    ({'cad_index': 7}, '07.off: no such mesh file')])
def test_what_cannot_be_measured_is_left_out_and_told_why(changes, reason, root):
    annotate(root, 'car_imagenet/bad', annotated(**changes))
    photograph(root, 'car_imagenet/bad.JPEG', np.full((400, 400, 3), 60, np.uint8))
    views = read(root)
    assert [folder.name for folder in views.folders] == ['car_imagenet/one/1']
    (told,) = views.unreadable
    assert 'bad' in told
    assert re.search(reason, told)


def test_an_image_that_is_missing_or_truncated_is_left_out_and_told(root):
    annotate(root, 'car_imagenet/none', annotated())
    annotate(root, 'car_imagenet/short', annotated())
    noise = np.random.default_rng(0).integers(0, 256, (400, 400, 3), np.uint8)
    path = photograph(root, 'car_imagenet/short.JPEG', noise)
    path.write_bytes(path.read_bytes()[:20000])
    views = read(root)
    assert len(views) == 1
    missing, truncated = views.unreadable
    assert 'no image: expected none.jpg (or .JPEG)' in missing
    assert 'short.JPEG: unreadable image: expected a whole one, got: ' in truncated


@pytest.mark.parametrize('content', [b'', b'no MATLAB file', b'MATLAB 5.0 MAT-file' + bytes(400)])
def test_a_file_that_is_no_annotation_is_left_out_and_told(content, root):
    (root / 'Annotations/car_imagenet/bad.mat').write_bytes(content)
    _, (told,) = list_photographs(root)
    assert 'bad.mat: no readable annotation: expected a MATLAB file with record.objects' in told


def test_an_annotation_of_another_form_is_left_out_and_told(root):
    savemat(root / 'Annotations/car_imagenet/bad.mat', {'record': {'filename': 'bad.jpg'}})
    savemat(root / 'Annotations/car_imagenet/worse.mat', {'annotation': 1})
    photographs, told = list_photographs(root)
    assert len(photographs) == 1
    assert ['record.objects' in line for line in told] == [True, True]


@pytest.mark.parametrize('name', ['Annotations', 'Images', 'CAD'])
def test_a_folder_that_is_not_pascal3d_is_refused(name, root):
    (root / name).rename(root / 'elsewhere')
    with pytest.raises(DataError, match=f'not the PASCAL3D.* found no folder {name}'):
        list_photographs(root)


def test_photographs_of_which_none_can_be_read_are_refused_with_the_reasons(root):
    (root / 'CAD/car/01.off').unlink()
    with pytest.raises(DataError, match='(?s)no readable photograph.*no such mesh file'):
        read(root)
    annotate(root, 'car_imagenet/one', annotated(truncated=1))
    with pytest.raises(DataError, match='(?s)no readable photograph.*it is truncated'):
        read(root)


def test_every_photograph_is_told_to_the_progress_once(root):
    annotate(root, 'car_imagenet/one', annotated(), annotated(cad_index=9))
    told = []
    read_photographs(*list_photographs(root), progress=lambda: told.append(1))
    assert len(told) == 2


def test_photographs_are_evaluated_at_their_single_view(root, tmp_path, monkeypatch, capsys):
    from command_line import command
    annotate(root, 'car_imagenet/two', annotated(truncated=1))
    monkeypatch.setattr('torch.set_num_threads', lambda threads: None)
    out = tmp_path / 'found.json'
    asked = ['evaluate', root, '--json', out, '--threads', 1]
    assert command(monkeypatch, *asked, '--model', PAPER_MODEL) == 0
    found = json.loads(out.read_text())
    assert found['objects'] == found['episodes'] == 1
    assert [len(figures['iou']) for figures in found['policies'].values()] == [1] * 4
    assert len(found['unreadable']) == 1
    told = capsys.readouterr().err
    assert 'views per object: 1; measured views: 1; starts: 1' in told
    assert 'objects: 1 read, 0 missing, 1 left out' in told
    assert command(monkeypatch, *asked) == 2
    assert 'photographs without camera poses' in capsys.readouterr().err
