"""The object is told from the room by a mask, by an image of the empty scene, or by a colour."""

from active_recon.acquisition.background import (
    Background,
    main_part_share,
    off_color,
    off_reference,
    on_white,
)
from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.canonical import canonical_image
from active_recon.shapes import make_shape
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
import pytest

SIDE = 320
GREEN = (30, 170, 70)
OBJECTS = [('chair', 0), ('table', 1), ('lamp', 0), ('car', 0), ('sofa', 2)]


@pytest.fixture(params=OBJECTS, ids=lambda shape: shape[0])
def shown(request):
    """Return an object alone, (SIDE, SIDE, 4)."""
    camera = orbit_camera(0.9, intrinsics=CANONICAL_INTRINSICS.resized(SIDE, SIDE))
    return Renderer(make_shape(*request.param)).render(camera)


def truth(rgba):
    return rgba[..., 3] > 127


def grainy(image, rng):
    return np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)


def clutter(rng, side=SIDE):
    """Return boxes of all colours, (side, side, 3)."""
    scene = np.full((side, side, 3), 150, np.uint8)
    for _ in range(40):
        corner = rng.integers(0, side, 2)
        cv2.rectangle(scene, corner.tolist(), (corner + rng.integers(5, side // 3, 2)).tolist(),
                      rng.integers(0, 256, 3).tolist(), -1)
    return scene


def uneven(color, side=SIDE):
    """Return a wall of one colour, twice as bright at one corner as at the other."""
    light = np.add.outer(np.linspace(0.6, 0.9, side), np.linspace(0, 0.3, side))
    return np.clip(np.asarray(color) * light[..., None], 0, 255).astype(np.uint8)


@pytest.mark.parametrize('turn', [1, 2])
def test_an_image_that_was_turned_by_numpy_is_as_any_other(turn):
    image = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    mask = image[..., 0] > 99
    np.testing.assert_array_equal(on_white(np.rot90(image, turn), np.rot90(mask, turn)),
                                  np.rot90(on_white(image, mask), turn))


@pytest.mark.parametrize('seed', range(2))
def test_an_object_before_clutter_is_found_by_an_image_of_the_clutter_alone(shown, seed):
    rng = np.random.default_rng(seed)
    scene = clutter(rng)
    found = off_reference(grainy(composite(shown, scene), rng), grainy(scene, rng))
    assert iou(found, truth(shown), (-2, -1)) > 0.95


def test_an_object_before_a_wall_in_uneven_light_is_found_by_the_wall_s_color(shown):
    rng = np.random.default_rng(0)
    found = off_color(grainy(composite(shown, uneven(GREEN)), rng), GREEN)
    assert iou(found, truth(shown), (-2, -1)) > 0.95


def test_what_is_found_in_an_image_of_another_size_is_the_same(shown):
    large = cv2.resize(composite(shown, uneven(GREEN)), (2000, 1500))
    found = off_color(large, GREEN)
    assert found.shape == (1500, 2000)
    expected = cv2.resize(truth(shown).astype(np.uint8), (2000, 1500)) > 0
    assert iou(found, expected, (-2, -1)) > 0.95


def test_the_background_becomes_white_and_the_object_stays(shown):
    image, mask = composite(shown, clutter(np.random.default_rng(0))), truth(shown)
    whitened = on_white(image, mask)
    np.testing.assert_array_equal(whitened[mask], image[mask])
    assert (whitened[~mask] == 255).all()
    assert whitened.dtype == np.uint8


def test_the_network_sees_a_cleared_view_nearly_as_one_before_white(shown):
    rng = np.random.default_rng(0)
    camera = orbit_camera(0.9, intrinsics=CANONICAL_INTRINSICS.resized(SIDE, SIDE))
    scene = clutter(rng)
    views = {'reference': (grainy(composite(shown, scene), rng), grainy(scene, rng)),
             'color': (grainy(composite(shown, uneven(GREEN)), rng), None)}
    expected = canonical_image(composite(shown, 255), camera)[0].astype(int)
    for how, (image, reference) in views.items():
        cleared = Background(how, GREEN).cleared(image, reference=reference)
        away = [np.abs(canonical_image(one, camera)[0] - expected).mean()
                for one in (cleared, image)]
        assert away[0] < 2 < 50 < away[1]


def test_holes_through_the_object_show_the_background():
    ring = np.zeros((SIDE, SIDE, 4), np.uint8)
    cv2.circle(ring, (160, 160), 90, (200, 40, 40, 255), 30)
    found = off_color(composite(ring, uneven(GREEN)), GREEN)
    assert not found[160, 160]
    assert iou(found, truth(ring), (-2, -1)) > 0.99


def test_an_object_partly_of_the_background_s_color_is_in_pieces():
    pillar = np.full((SIDE, SIDE, 3), GREEN, np.uint8)
    pillar[40:280, 140:180] = (200, 30, 30)
    whole = Background('color', GREEN).cleared(pillar)
    assert main_part_share(whole) == 1
    assert main_part_share(np.full_like(whole, 255)) == 0
    pillar[140:180, 140:180] = GREEN
    assert main_part_share(Background('color', GREEN).cleared(pillar)) == pytest.approx(0.5, 0.02)


@pytest.mark.parametrize('side', [SIDE, 3000])
def test_the_share_of_the_largest_part_does_not_depend_on_the_image_s_size(side):
    cleared = np.full((SIDE, SIDE, 3), 255, np.uint8)
    cleared[40:120, 100:200] = 254
    cleared[200:240, 100:200] = 30
    cleared = cv2.resize(cleared, (side, side), interpolation=cv2.INTER_NEAREST)
    assert main_part_share(cleared) == pytest.approx(2 / 3, abs=0.01)


def test_a_speck_of_noise_is_no_part_of_the_object():
    image = np.full((SIDE, SIDE, 3), 128, np.uint8)
    reference = image.copy()
    image[100:200, 100:200] = 250, 30, 30
    image[10:13, 10:13] = 250, 30, 30
    assert not off_reference(image, reference)[:50, :50].any()


def test_a_weak_shadow_is_no_part_of_the_object():
    reference = np.full((SIDE, SIDE, 3), 180, np.uint8)
    image = reference.copy()
    image[100:200, 200:300] = 165
    image[100:200, 100:200] = 40, 60, 160
    found = off_reference(image, reference)
    assert found[150, 150]
    assert not found[150, 250]


def test_an_image_of_the_empty_scene_has_no_object():
    rng = np.random.default_rng(1)
    scene = clutter(rng)
    for image in (scene, grainy(scene, rng)):
        with pytest.raises(ViewError, match='nothing does from the empty scene') as refusal:
            off_reference(image, scene)
        assert refusal.value.kind == 'no_object'
    with pytest.raises(ViewError, match=r'nothing does from the color \[30, 170, 70\]') as refusal:
        off_color(uneven(GREEN), GREEN)
    assert refusal.value.kind == 'no_object'


def test_a_scene_that_changed_as_a_whole_is_refused():
    image = np.full((64, 64, 3), 200, np.uint8)
    for find in (lambda: off_reference(image, image // 4), lambda: off_color(image, (255, 0, 0))):
        with pytest.raises(ViewError, match='all of the image stands out') as refusal:
            find()
        assert refusal.value.kind == 'no_background'


def test_a_reference_of_another_size_is_refused():
    with pytest.raises(ViewError, match='size, 64 x 48, got 48 x 64.*capture_background') as error:
        off_reference(np.zeros((64, 48, 3), np.uint8), np.zeros((48, 64, 3), np.uint8))
    assert error.value.kind == 'reference'


@pytest.mark.parametrize(('mask', 'kind', 'said'), [
    (np.ones((64, 47), np.bool_), 'mask', 'size, 48 x 64, got 47 x 64'),
    (np.zeros((64, 48), np.bool_), 'no_object', 'all background'),
])
def test_a_mask_that_cannot_be_used_is_refused(mask, kind, said):
    with pytest.raises(ViewError, match=said) as refusal:
        on_white(np.zeros((64, 48, 3), np.uint8), mask)
    assert refusal.value.kind == kind


@pytest.mark.parametrize(('color', 'tolerance', 'said'), [
    ((1, 2), 10, 'background_color: .*got'), ((0, 0, 0), 10, 'background_color'),
    ((0, 256, 0), 10, 'background_color'), ((0, -1, 0), 10, 'background_color'),
    (GREEN, 0.0, 'background_tolerance: .*got 0.0'),
    (GREEN, float('nan'), 'background_tolerance'),
])
def test_a_color_key_that_cannot_be_used_is_refused(color, tolerance, said):
    for make in (Background, lambda *key: off_color(np.zeros((64, 48, 3), np.uint8), *key[1:])):
        with pytest.raises(ConfigError, match=said):
            make('color', color, tolerance)


def test_each_way_to_tell_the_background_makes_it_white(shown):
    scene, mask = uneven(GREEN), truth(shown)
    image = composite(shown, scene)
    np.testing.assert_array_equal(Background('mask').cleared(image, mask=mask),
                                  on_white(image, mask))
    np.testing.assert_array_equal(Background('color', GREEN).cleared(image),
                                  on_white(image, off_color(image, GREEN)))
    np.testing.assert_array_equal(Background('reference').cleared(image, reference=scene),
                                  on_white(image, off_reference(image, scene)))


def test_an_image_that_is_to_stay_as_it_is_stays_so():
    image = uneven(GREEN)
    assert Background().cleared(image, np.zeros((SIDE, SIDE), np.bool_), image) is image


@pytest.mark.parametrize(('how', 'kind', 'said'), [
    ('mask', 'no_mask', "no mask: expected a mask of the image's stamp, got none"),
    ('reference', 'no_reference', 'empty the scene and call capture_background')])
def test_what_is_needed_to_tell_the_background_is_asked_for(how, kind, said):
    with pytest.raises(ViewError, match=said) as refusal:
        Background(how).cleared(uneven(GREEN))
    assert refusal.value.kind == kind


def test_a_way_to_tell_the_background_that_nobody_knows_is_refused():
    with pytest.raises(ConfigError, match="background: unknown value: expected one of as_is.*got "
                                          "'magic'"):
        Background('magic')
