"""Things: many kinds drawn by their seed, one body each, hollow where the real ones are."""

from active_recon.datasets.making import make_object, shape_jobs
from active_recon.errors import ConfigError
from active_recon.shapes import ALL_CATEGORIES, make_shape, THINGS
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import box
from active_recon.shapes.things import GENERATORS, KINDS, thing
from active_recon.shapes.things.animals import beast, bird, fish, plush
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.fields import ball, block, column, molten, waves
from active_recon.shapes.things.patterns import decorated, split
from active_recon.shapes.things.polygons import area, triangulated
from active_recon.shapes.things.poses import laid, stretched
from active_recon.shapes.things.shells import carton
from active_recon.shapes.things.soft import blob
from active_recon.shapes.things.solids import circle, extruded, pipe, revolved, skin, swept, torus
from active_recon.shapes.things.vessels import bucket, mug, pan
from active_recon.volumes.meshes import fit_to_grid
from active_recon.volumes.voxelisation import voxelise
import numpy as np
import pytest
from scipy import ndimage

SEEDS = range(30)


@pytest.fixture(scope='module')
def drawn():
    return [make_shape('thing', seed) for seed in SEEDS]


def loose_share(mesh):
    """Return the share of the occupied cells, 64 a side, that hang with nothing else."""
    labels, _ = ndimage.label(voxelise(mesh, 64).occupied(0.5), np.ones((3, 3, 3)))
    sizes = np.bincount(labels.ravel())[1:]
    return 1 - sizes.max() / sizes.sum()


def upright(generator, seed):
    """Return a generator's object as it was made, unturned, fitted to the grid."""
    return fit_to_grid(generator(np.random.default_rng(seed)))


def test_things_are_none_of_the_categories_and_are_made_by_name_alone():
    assert not set(THINGS) & set(ALL_CATEGORIES)
    with pytest.raises(ConfigError, match="motorbike, thing, got 'castle'"):
        make_shape('castle', 0)


def test_a_seed_gives_the_same_thing_again(drawn):
    for seed in (3, 11, 27):
        again = make_shape('thing', seed)
        np.testing.assert_array_equal(again.vertices, drawn[seed].vertices)
        np.testing.assert_array_equal(again.faces, drawn[seed].faces)
        np.testing.assert_array_equal(again.visual.face_colors, drawn[seed].visual.face_colors)


def test_seeds_differ_in_structure_and_not_only_in_size(drawn):
    assert len({len(mesh.faces) for mesh in drawn}) >= 0.9 * len(drawn)
    assert len({mesh.body_count for mesh in drawn}) >= 8


def test_a_thing_fits_the_grid_and_is_finite(drawn):
    for mesh in drawn:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.extents.max() == pytest.approx(1)
        np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0, atol=1e-9)
        assert mesh.area_faces.min() > 0
        assert len(mesh.faces) < 60_000


def test_things_are_coloured_and_most_in_several_colours(drawn):
    assert {mesh.visual.kind for mesh in drawn} == {'face'}
    counts = [len(np.unique(mesh.visual.face_colors, axis=0)) for mesh in drawn]
    assert np.mean(np.array(counts) > 1) > 0.6


def test_things_are_dark_pale_and_loud():
    palettes = np.array([draw_palette(np.random.default_rng(seed))[0] for seed in range(300)])
    assert palettes.min() >= 0
    assert palettes.max() <= 255
    brightest, faintest = palettes.max(axis=1), palettes.min(axis=1)
    assert np.mean(brightest < 70) > 0.08
    assert np.mean(faintest > 180) > 0.08
    assert np.mean(brightest - faintest > 120) > 0.25


def test_no_part_of_a_thing_floats(drawn):
    assert max(map(loose_share, drawn)) < 0.005


@pytest.mark.slow
def test_at_most_one_in_a_hundred_things_has_a_part_that_floats():
    loose = [loose_share(make_shape('thing', seed)) > 0.005 for seed in range(1000, 1300)]
    assert np.mean(loose) <= 0.01


@pytest.mark.parametrize('generator', GENERATORS, ids=lambda generator: generator.__name__)
def test_every_generator_makes_coloured_connected_objects(generator):
    meshes = [upright(generator, seed) for seed in range(2)]
    assert meshes[0].area != meshes[1].area
    for mesh in meshes:
        assert mesh.visual.kind == 'face'
        assert len(mesh.faces) < 60_000
        assert loose_share(mesh) < 0.005


def test_every_generator_is_drawn_and_each_kind_in_its_share():
    draws = [choose(np.random.default_rng(seed), GENERATORS) for seed in range(3000)]
    assert set(draws) == set(GENERATORS)
    assert len(GENERATORS) >= 30
    assert sum(GENERATORS.values()) == pytest.approx(1)
    for share, generators in KINDS.values():
        assert np.mean([draw in generators for draw in draws]) == pytest.approx(share, abs=0.03)


def test_a_cup_that_stands_holds_a_cavity_above_its_bottom():
    depths = []
    for seed in range(16):
        cells = voxelise(upright(mug, seed), 64).occupied(0.5)
        body = cells[:, :, cells.any(axis=(0, 1)).argmax()]  # the foot tells where the axis is
        x, y = (int(np.median(axis)) for axis in np.nonzero(body))
        filled = np.flatnonzero(cells[x, y])
        top = np.flatnonzero(cells.any(axis=(0, 1)))
        assert filled[0] == top[0]
        depths.append(1 - (np.ptp(filled) + 1) / len(top))
    assert np.mean(np.array(depths) > 0.6) > 0.7  # the others hold a drink


@pytest.mark.parametrize('generator', [bucket, carton])
@pytest.mark.parametrize('resolution', [32, 64])
def test_what_is_open_above_is_hollow_at_both_resolutions(generator, resolution):
    filled = []
    for seed in range(8):
        cells = voxelise(upright(generator, seed), resolution).occupied(0.5)
        enclosed = ndimage.binary_fill_holes(cells.any(axis=2))
        filled.append(cells.sum() / (enclosed.sum() * cells.any(axis=(0, 1)).sum()))
    assert np.median(filled) < 0.55


def test_a_pan_is_wider_than_high():
    for seed in range(6):
        size = upright(pan, seed).extents
        assert size[2] < size[0]


def test_most_things_stand_and_others_lie_tipped_or_any_way():
    rng = np.random.default_rng(0)

    def final_up():
        mesh = box([-1, -0.6, -0.2], [1, 0.6, 0.2], (255, 0, 0))
        top = int(mesh.face_normals[:, 2].argmax())
        return laid(rng, mesh).face_normals[top]

    ups = np.array([final_up() for _ in range(600)])
    standing = np.abs(ups[:, 2] - 1) < 1e-6
    along_axis = np.isclose(np.abs(ups[:, 2]), 1) | np.isclose(ups[:, 2], 0, atol=1e-6)
    assert np.mean(standing) == pytest.approx(0.6, abs=0.05)
    assert np.mean(along_axis & ~standing) == pytest.approx(0.25, abs=0.05)


def test_a_thing_is_stretched_in_two_cases_of_five_and_never_by_more_than_was_asked():
    rng = np.random.default_rng(0)
    sizes = np.array([stretched(rng, box([0] * 3, [1] * 3, (0, 0, 0))).extents
                      for _ in range(400)])
    changed = np.ptp(sizes, axis=1) > 1e-9
    assert np.mean(changed) == pytest.approx(0.4, abs=0.07)
    assert sizes.min() >= 0.7
    assert sizes.max() <= 1.4


def test_a_polygon_with_holes_is_cut_into_triangles_that_cover_it_once():
    rng = np.random.default_rng(0)
    for points in (7, 30):
        outline = circle(points) * rng.uniform(0.8, 1.2, (points, 1))
        holes = [circle(9, 0.15) + center for center in ((0.4, 0), (-0.4, 0.1), (0, -0.4))]
        for way in (1, -1):
            vertices, faces = triangulated(outline[::way], holes)
            pieces = [area(vertices[face]) for face in faces]
            assert min(pieces) > 0
            whole = abs(area(outline)) - sum(abs(area(hole)) for hole in holes)
            assert sum(pieces) == pytest.approx(whole)
            assert len(faces) == len(vertices) - 2 + 2 * len(holes)


def test_extrusions_and_sweeps_have_the_volumes_that_geometry_tells():
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2]])
    holed = extruded(square, 0, 3, (0, 0, 0), [0.5 * square + 0.5])
    assert holed.is_watertight
    assert abs(holed.volume) == pytest.approx(9)
    bar = swept([[0, 0, 0], [3, 0, 0], [3, 4, 0]], (square - 1) * 0.1, (0, 0, 0))
    assert abs(bar.volume) == pytest.approx(7 * 0.04)
    tube = pipe([[0, 0, 0], [0, 0, 5]], circle(60, 0.5), 0.5, (0, 0, 0))
    assert abs(tube.volume) == pytest.approx(5 * np.pi * (0.25 - 0.0625), rel=0.01)
    assert abs(torus(2, 0.5, (0, 0, 0)).volume) == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=0.05)
    ring = swept(np.insert(circle(90), 2, 0, axis=1), circle(16, 0.1), (0, 0, 0), closed=True)
    assert ring.is_watertight
    assert abs(ring.volume) == pytest.approx(2 * np.pi**2 * 0.01, rel=0.05)


def test_a_skin_takes_a_colour_for_each_band():
    rings = [np.insert(circle(5), 2, z, axis=1) for z in (0, 1, 2)]
    mesh = skin(rings, [[255, 0, 0], [0, 0, 255]])
    below = mesh.triangles_center[:, 2] < 1
    assert (mesh.visual.face_colors[below, 0] == 255).all()
    assert (mesh.visual.face_colors[~below, 2] == 255).all()


def test_melted_bodies_take_their_colours_and_what_is_cut_off_is_gone():
    red, blue, green = (255, 0, 0), (0, 0, 255), (0, 255, 0)
    mesh = molten([ball([0, 0, 0], [1, 1, 1], red), ball([1.5, 0, 0], [0.8] * 3, blue)], 0.2,
                  [column([-3, 0, 0], [3, 0, 0], 0.3, green)])
    assert mesh.is_watertight
    assert {tuple(map(int, color[:3])) for color in mesh.visual.face_colors} == {red, blue, green}
    halves = molten([block([0, 0, 0], [3, 1, 1], red)],
                    cuts=[block([1, -1, -1], [1.5, 2, 2], green)])
    assert halves.body_count == 1
    assert halves.extents[0] == pytest.approx(1.5, abs=0.05)


def test_a_split_keeps_the_surface_and_leaves_no_triangle_on_both_sides():
    mesh = revolved([[1, 0], [0.6, 1], [0.9, 2]], (10, 20, 30))
    cut = split(mesh, lambda points: points[:, 2] - 0.7)
    assert cut.area == pytest.approx(mesh.area)
    heights = cut.vertices[cut.faces][..., 2] - 0.7
    assert ((heights >= -1e-6).all(axis=1) | (heights <= 1e-6).all(axis=1)).all()


@pytest.mark.slow
def test_a_pattern_changes_colours_and_not_the_shape():
    changed = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        mesh = revolved([[1, 0], [0.6, 1], [0.9, 2]], (10, 20, 30))
        before = mesh.area
        patterned = decorated(rng, mesh, draw_palette(rng))
        assert patterned.area == pytest.approx(before)
        assert len(patterned.faces) < 60_000
        changed.append(len(np.unique(patterned.visual.face_colors, axis=0)) > 1)
    assert np.mean(changed) > 0.8


def test_things_are_made_into_a_dataset_like_a_category(tmp_path):
    (job,) = shape_jobs('thing', [5], tmp_path)
    assert not make_object(job, samples=1).refusal
    assert job.folder.category == 'thing'
    np.testing.assert_array_equal(job.folder.voxels().occupancy,
                                  voxelise(make_shape('thing', 5)).occupancy)


def test_a_thing_is_drawn_from_the_generator_s_numbers_alone():
    one, other = (thing(np.random.default_rng(8)) for _ in range(2))
    np.testing.assert_array_equal(one.vertices, other.vertices)


def test_bodies_that_swell_stay_closed():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        bumps = waves(rng, rng.uniform(0.5, 1.6), 0.17)
        assert molten([ball([0, 0, 0], [1, 0.8, 0.6], (0, 0, 0))], bumps=bumps).is_watertight
    for generator in (beast, plush, bird, fish, blob):
        assert generator(np.random.default_rng(1)).is_watertight
