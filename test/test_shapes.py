"""Parametric shapes: drawn by their seed, varied in structure, one solid, fronts at +x."""

from pathlib import Path
import shutil

from active_recon import shapes
from active_recon.errors import ConfigError
from active_recon.shapes import ALL_CATEGORIES, generators_hash, make_shape
from active_recon.volumes.voxelisation import voxelise
import numpy as np
import pytest
from scipy import ndimage

SEEDS = range(6)


@pytest.fixture(scope='module')
def drawn():
    return {category: [make_shape(category, seed) for seed in SEEDS]
            for category in ALL_CATEGORIES}


@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_a_seed_gives_the_same_object_again(category, drawn):
    again, first = make_shape(category, 2), drawn[category][2]
    np.testing.assert_array_equal(again.vertices, first.vertices)
    np.testing.assert_array_equal(again.faces, first.faces)
    np.testing.assert_array_equal(again.visual.face_colors, first.visual.face_colors)


@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_seeds_differ_in_structure_and_not_only_in_size(category, drawn):
    assert len({len(mesh.faces) for mesh in drawn[category]}) >= 4
    assert len({mesh.body_count for mesh in drawn[category]}) >= 3


@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_a_shape_fits_the_grid_and_is_finite(category, drawn):
    for mesh in drawn[category]:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.extents.max() == pytest.approx(1)
        np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0, atol=1e-9)
        assert mesh.area > 0


@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_shapes_are_coloured_each_in_its_own_way(category, drawn):
    assert {mesh.visual.kind for mesh in drawn[category]} == {'face'}
    colors = {tuple(mesh.visual.face_colors.mean(axis=0)) for mesh in drawn[category]}
    assert len(colors) == len(SEEDS)


def loose_share(mesh):
    """Return the share of the occupied cells, 64 a side, that hang with nothing else."""
    labels, _ = ndimage.label(voxelise(mesh, 64).occupied(0.5), np.ones((3, 3, 3)))
    sizes = np.bincount(labels.ravel())[1:]
    return 1 - sizes.max() / sizes.sum()


@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_no_part_of_a_shape_floats(category, drawn):
    assert max(map(loose_share, drawn[category])) < 0.005


@pytest.mark.slow
@pytest.mark.parametrize('category', ALL_CATEGORIES)
def test_at_most_two_in_a_hundred_shapes_have_a_part_that_floats(category):
    loose = [loose_share(make_shape(category, seed)) > 0.005 for seed in range(1000, 1200)]
    assert np.mean(loose) <= 0.02


def upper_half_x(mesh):
    """Return where the surface above the middle of the height has its mean x."""
    centers = mesh.triangles_center
    upper = centers[:, 2] > 0
    return float(np.average(centers[upper, 0], weights=mesh.area_faces[upper]))


@pytest.mark.parametrize('category', ['chair', 'sofa'])
def test_what_is_sat_on_has_its_back_at_minus_x(category):
    offsets = np.array([upper_half_x(make_shape(category, seed)) for seed in range(30)])
    assert offsets.mean() < -0.05
    assert np.mean(offsets < 0.01) > 0.85


def test_an_airplane_s_tail_is_behind_and_a_car_is_longer_than_wide(drawn):
    assert np.mean([mesh.vertices[mesh.vertices[:, 2].argmax(), 0]
                    for mesh in drawn['airplane']]) < -0.1
    for mesh in drawn['car']:
        length, width, _ = mesh.extents
        assert length > 1.2 * width


def test_categories_do_not_share_their_draws():
    rngs = [make_shape(category, 0).extents for category in ('chair', 'table')]
    assert not np.allclose(*rngs)


def test_an_unknown_category_is_refused():
    with pytest.raises(ConfigError, match="one of airplane, .*, got 'castle'"):
        make_shape('castle', 0)


def test_the_generators_hash_changes_with_their_code_alone(tmp_path, monkeypatch):
    shutil.copytree(Path(shapes.__file__).parent, tmp_path, dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns('__pycache__'))
    true_hash = generators_hash()
    assert len(bytes.fromhex(true_hash)) == 32
    monkeypatch.setattr(shapes, '__file__', str(tmp_path / '__init__.py'))
    (tmp_path / 'notes.txt').write_text('no code')
    assert generators_hash() == true_hash
    with (tmp_path / 'sofa.py').open('a') as file:
        file.write('\n')
    changed = generators_hash()
    assert changed != true_hash
    (tmp_path / 'sofa.py').rename(tmp_path / 'couch.py')
    renamed = generators_hash()
    assert renamed not in (true_hash, changed)
    (tmp_path / 'things' / 'vessels.py').rename(tmp_path / 'vessels.py')
    assert generators_hash() not in (true_hash, changed, renamed)
