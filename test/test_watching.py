"""Photos that arrive: each is taken in or left out, and it is told where to stand next."""

from dataclasses import replace
import json
import math
import re
import shutil
import signal
from types import SimpleNamespace

from active_recon.cli.main import app
from active_recon.errors import ConfigError, DataError
from active_recon.photos.files import open_photo, open_photos
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_files, from_views
from active_recon.photos.sources import BoardCameras, posed_by, TurntableCameras
from active_recon.policies.stopping import StoppingRule
from active_recon.runtimes import precision
from active_recon.volumes.voxels import VoxelGrid
from active_recon.watching.advice import Adviser, ELEVATIONS, ENOUGH
from active_recon.watching.arrivals import Arrivals, EMPTY_S, SETTLED_S
from active_recon.watching.collection import Collection
from active_recon.watching.directions import where_to_stand
from active_recon.watching.sketch import NEXT_COLOR, SIDE, sketch
from active_recon.watching.watch_page import loop_state, qr_code, WatchPage
from active_recon.watching.watcher import Progress, told, Watcher
import cv2
import numpy as np
from photo_scene import cameras, on_plain, rendered, write_photos
from PIL import Image
import pytest
from rendered_boards import BOARD, LENS
from typer.testing import CliRunner
from watched_photos import orbit, with_focal, written

pytestmark = pytest.mark.usefixtures('loaded_once')
SOURCE = BoardCameras(BOARD)
_SAME = 1e-2  # the search for the lens ends a little elsewhere in each run


@pytest.fixture(scope='module', autouse=True)
def in_f32():
    """Compute in f32: bf16 rounds by more than what is told apart, on some processors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(precision, 'has_bf16', lambda: False)
        yield


@pytest.fixture(scope='module')
def photos(tmp_path_factory):
    return written(tmp_path_factory.mktemp('photos'))


@pytest.fixture(scope='module')
def collection(photos):
    """Return a collection of all photos but the last."""
    found = Collection(SOURCE, Options())
    assert [found.add(path) for path in photos[:-1]] == [''] * 3
    return found


@pytest.fixture(scope='module')
def posed(tmp_path_factory):
    """Return a folder of four photos before a plain background, and a file of their cameras."""
    views = cameras(4)
    return write_photos(tmp_path_factory.mktemp('posed'), views, map(on_plain, rendered(views)))


@pytest.fixture(scope='module')
def shape(collection):
    return collection.shape


@pytest.fixture(scope='module')
def usual(shape):
    """Return the shape as of views that are not flagged, which three of a board may well be."""
    *first, last = shape.views
    quality = replace(shape.quality, p_value=0.5, suspect='')
    known = replace(last.known, judge=lambda: quality)
    return replace(shape, views=[*first, replace(last, known=known)])


@pytest.fixture(scope='module')
def adviser():
    return Adviser(StoppingRule(12))


def test_photos_that_arrive_have_the_shape_of_all_of_them_at_once(photos, shape):
    at_once = from_files(photos[:-1], SOURCE)
    np.testing.assert_allclose(shape.occupancy, at_once.occupancy, atol=_SAME)
    np.testing.assert_allclose(shape.world_from_object, at_once.world_from_object, atol=1e-6)


def test_what_is_wrong_with_a_photo_is_one_line_and_the_shape_stays(collection, photos, tmp_path):
    Image.new('RGB', (640, 480), (90, 120, 90)).save(tmp_path / 'empty.jpg')
    (tmp_path / 'cut.png').write_bytes(photos[0].read_bytes()[:20_000])
    shutil.copy(photos[0], tmp_path / 'again.png')
    (tmp_path / 'phone.dng').write_bytes(b'any')
    before = collection.shape.occupancy
    for name, words in (('empty.jpg', 'no board seen in it'), ('cut.png', 'not readable'),
                        ('again.png', 'the same photo as 0.png'),
                        ('phone.dng', 'not readable: .* a raw photo: convert it')):
        reason = collection.add(tmp_path / name)
        assert re.match(f'{name}: {words}', reason) and '\n' not in reason
    assert collection.shape.occupancy is before


def test_photos_that_arrive_together_have_the_shape_and_the_faults_of_one_by_one(
        collection, photos, tmp_path):
    (tmp_path / 'cut.png').write_bytes(photos[0].read_bytes()[:20_000])
    shutil.copy(photos[0], tmp_path / 'again.png')
    found = Collection(SOURCE, Options())
    assert found.add_all(photos[:2]) == ['', ''] and found.shape is None and found.count == 2
    reasons = found.add_all([tmp_path / 'cut.png', photos[2], tmp_path / 'again.png'])
    assert [reason.partition(':')[0] for reason in reasons] == ['cut.png', '', 'again.png']
    np.testing.assert_allclose(found.shape.occupancy, collection.shape.occupancy, atol=_SAME)


def test_one_shape_is_made_of_photos_that_arrive_or_go_together(posed, monkeypatch):
    made = []
    monkeypatch.setattr('active_recon.watching.collection.from_views', lambda views, *rest, **more:
                        made.append(len(views)) or from_views(views, *rest, **more))
    found = Collection(posed / 'transforms.json', Options())
    found.add_all([posed / f'photo{number}.png' for number in range(4)])
    assert made == [4] and len(found.shape.views) == 4
    found.remove(posed / 'photo0.png', posed / 'photo3.png', posed / 'none.png')
    assert made == [4, 2] and found.count == 2


def test_until_the_lens_is_known_it_is_said_what_is_missing(photos):
    found = Collection(SOURCE, Options())
    assert found.waiting == 'no photo yet'
    assert found.add(photos[0]) == '' and found.shape is None
    assert found.waiting.startswith('1 photo with the board: the lens is estimated from three')


def test_a_focal_length_in_exif_gives_a_shape_from_the_first_photo_on(photos, tmp_path):
    found = Collection(SOURCE, Options())
    assert found.add(with_focal(photos[0], tmp_path / 'a.jpg')) == ''
    assert found.shape is not None and found.metric
    assert found.shape.views[0].camera.intrinsics.fx == pytest.approx(LENS.fx, rel=1e-3)


def test_the_board_refines_the_focal_length_that_exif_gives(photos, tmp_path):
    paths = [with_focal(path, tmp_path / f'{path.stem}.jpg') for path in photos]
    files = [*open_photos(paths)[0]]
    wrong = [type(each)(each.path, each.size, 1, 1.2 * each.focal) for each in files]
    _, posed, _ = posed_by(SOURCE, wrong)
    assert posed[0].intrinsics.fx == pytest.approx(LENS.fx, rel=0.02)
    _, posed, _ = posed_by(SOURCE, wrong[:2])  # too few to refine it
    assert posed[0].intrinsics.fx == pytest.approx(1.2 * LENS.fx, rel=1e-3)


def test_a_file_of_cameras_poses_photos_that_arrive(posed, tmp_path):
    Image.new('RGB', (240, 180)).save(tmp_path / 'other.png')
    found = Collection(posed / 'transforms.json', Options())
    assert found.add(posed / 'photo0.png') == '' and found.shape is None
    assert found.waiting.startswith('no object found yet: object not found: expected photos from '
                                    'several directions')
    for number in (1, 2):
        assert found.add(posed / f'photo{number}.png') == ''
    assert len(found.shape.views) == 3 and not found.metric
    assert found.add(tmp_path / 'other.png') == (
        f'other.png: no camera in {posed / "transforms.json"}')
    assert len(found.shape.views) == 3


@pytest.mark.slow
def test_a_photo_that_is_gone_leaves_the_shape_of_the_others(posed):
    found = Collection(posed / 'transforms.json', Options())
    for number in range(3):
        assert found.add(posed / f'photo{number}.png') == ''
    before = found.shape.occupancy
    assert found.add(posed / 'photo3.png') == ''
    assert len(found.shape.views) == 4
    found.remove(posed / 'photo3.png')
    np.testing.assert_allclose(found.shape.occupancy, before, atol=_SAME)


def test_a_turntable_s_order_cannot_be_known_of_photos_that_arrive():
    with pytest.raises(ConfigError, match='expected a board or a file of cameras'):
        Collection(TurntableCameras(0.2, 0.3, 0.6), Options())


def test_a_file_has_arrived_once_it_no_longer_changes(tmp_path):
    arrivals = Arrivals(tmp_path)
    path = tmp_path / 'a.jpg'
    path.write_bytes(b'begun')
    for name in ('.syncthing.b.jpg.tmp', '.c.jpg', '~d.jpg', 'e.txt', 'f.jpg.part'):
        (tmp_path / name).write_bytes(b'other')
    assert arrivals.arrived(0.0) == []
    path.write_bytes(b'begun and going on')
    assert arrivals.arrived(10.0) == []
    assert arrivals.arrived(10.0 + 0.9 * SETTLED_S) == []
    assert arrivals.arrived(10.0 + SETTLED_S) == [path]
    assert arrivals.arrived(99.0) == [] and arrivals.gone() == []
    path.write_bytes(b'another')  # is a new photo under an old name
    assert arrivals.gone() == [path]
    assert arrivals.arrived(100.0) == []
    assert arrivals.arrived(101.0) == [path]
    path.unlink()
    assert arrivals.gone() == [path] and arrivals.gone() == []


def test_a_file_that_stays_without_bytes_is_told_once_and_a_copy_that_has_begun_is_not(
        tmp_path):
    arrivals = Arrivals(tmp_path)
    failed, begun = tmp_path / 'failed.jpg', tmp_path / 'begun.jpg'
    failed.touch()
    assert arrivals.arrived(0.0) == arrivals.arrived(2 * SETTLED_S) == []
    begun.touch()
    assert arrivals.arrived(EMPTY_S - 1) == []
    begun.write_bytes(b'all of it')
    assert arrivals.arrived(EMPTY_S) == [failed]
    assert arrivals.arrived(EMPTY_S + SETTLED_S) == [begun] and arrivals.gone() == []
    with pytest.raises(DataError, match='failed.jpg: not readable: .* got: a file of 0 bytes$'):
        open_photo(failed, {})
    failed.write_bytes(b'copied again')
    assert arrivals.gone() == [failed] and arrivals.arrived(30.0) == []
    assert arrivals.arrived(31.0) == [failed]


def test_photos_that_were_there_come_in_the_order_of_their_age(tmp_path):
    import os

    arrivals = Arrivals(tmp_path)
    for name, age in (('b.heic', 1), ('img10.jpg', 2), ('img2.jpg', 2), ('a.jpg', 3)):
        (tmp_path / name).write_bytes(b'x')
        os.utime(tmp_path / name, (age, age))
    arrivals.arrived(0.0)
    assert [path.name for path in arrivals.arrived(1.0)] == [
        'b.heic', 'img2.jpg', 'img10.jpg', 'a.jpg']
    with pytest.raises(DataError, match='no such folder'):
        Arrivals(tmp_path / 'none')


@pytest.mark.parametrize('turn', [-150, -90, -30, 30, 90, 150])
def test_left_and_right_are_those_of_who_looks_at_the_object(turn):
    last, goal = orbit(50), orbit(50 + turn)
    across = (goal.position - last.position) @ last.pose[:3, 0]  # x points right in the image
    words = where_to_stand(goal, last, metric=True)
    assert ('to the right' if across > 0 else 'to the left') in words
    mirrored = where_to_stand(orbit(50 - turn), last, metric=True)
    assert mirrored == words.replace('right', 'LEFT').replace('left', 'right').replace(
        'LEFT', 'left')


PARTS = {'twelfth': 30, 'eighth': 45, 'sixth': 60, 'quarter': 90, 'third': 120, 'nearly half': 150,
         'half a turn from': 180}


@pytest.mark.parametrize('turn', range(-175, 181, 12))
def test_the_part_of_a_turn_is_the_nearest_that_has_a_name(turn):
    words = where_to_stand(orbit(turn), orbit(0), metric=False)
    if abs(turn) < 8:
        assert words.startswith('from the side of the last photo')
        return
    named = next(degrees for part, degrees in PARTS.items() if part in words)
    assert abs(named - abs(turn)) == min(abs(each - abs(turn)) for each in PARTS.values())


def test_height_and_distance_are_told_where_they_change():
    told = where_to_stand(orbit(120, 45, 0.8), orbit(0, 20, 0.5), metric=True)
    assert told == ('a third of a turn to the right of the last photo, higher, camera at 45 '
                    'degrees, 80 cm from the object')
    assert 'cm' not in where_to_stand(orbit(120, 45, 0.8), orbit(0, 20, 0.5), metric=False)
    assert 'lower' in where_to_stand(orbit(0, 20), orbit(0, 45), True)
    level = where_to_stand(orbit(0, 30), orbit(0, 33), True)
    assert level == 'from the side of the last photo, camera at 30 degrees'


def test_the_goal_is_above_the_table_at_the_photos_own_distance(usual, adviser):
    advice = adviser.advice(usual)
    goal = advice.goal.camera
    assert ELEVATIONS[0] - 1e-6 <= goal.elevation <= ELEVATIONS[1] + 1e-6
    assert goal.distance == pytest.approx(np.median([
        view.camera.distance for view in usual.views]))
    assert advice.done == '' and advice.goal.gain is not None
    assert len({round(each.elevation, 3) for each in advice.goal.candidates}) == 3
    for view in usual.views:
        assert np.arccos(view.camera.direction @ goal.direction) > math.radians(10)


def test_it_is_enough_after_the_photos_planned_or_at_the_quality_asked_for(usual):
    planned = Adviser(StoppingRule(3)).advice(usual)
    assert planned.done == 'max_views' == loop_state(usual, planned).done
    assert told(usual, planned, metric=True)[0].startswith(
        f'Enough photos: {ENOUGH["max_views"]}. Another one would stand ')
    assert Adviser(StoppingRule(4, 0.0)).advice(usual).done == ''
    assert Adviser(StoppingRule(12, min_gain=0.9)).advice(usual).done == 'gain_too_small'


def test_a_target_quality_is_refused_for_weights_without_tables_of_quality():
    with pytest.raises(ConfigError, match='target_quality: .* carving-quality.json, found none'):
        Adviser(StoppingRule(12, target_quality=0.7), 'carving')
    Adviser(StoppingRule(12), 'carving')


@pytest.mark.slow
def test_photos_from_every_side_are_enough_and_no_other_place_is_told(usual):
    places = [orbit(15 * step, elevation) for elevation in (20, 40, 60) for step in range(24)]
    full = replace(usual, views=[replace(usual.views[-1], camera=camera) for camera in places])
    many = Adviser(StoppingRule(100, 0.0)).advice(full)
    assert many.goal is None and many.done
    assert told(full, many, metric=True)[0] == 'Enough photos: there is no place left.'
    assert loop_state(full, many).done == many.done


def test_the_sketch_has_the_last_photo_below_and_the_next_at_its_side(shape):
    last = shape.views[-1].camera
    for turn in (-90, 90):
        goal = orbit(math.degrees(last.azimuth) + turn, 30, last.distance)
        drawn = sketch(shape, goal, BOARD)
        assert drawn.shape == (SIDE, SIDE, 3)
        there = np.argwhere((drawn == NEXT_COLOR).all(axis=2))
        assert np.sign(there[:, 1].mean() - SIDE / 2) == np.sign(turn)
        assert there[:, 0].max() > SIDE / 2  # the way begins below
    none = sketch(shape, None, BOARD)
    assert not (none == NEXT_COLOR).all(axis=2).any()


def test_the_page_s_state_has_a_goal_until_there_are_enough(shape, adviser):
    state = loop_state(shape, adviser.advice(shape))
    assert state.goal is not None and len(state.views) == 3 and state.grid is shape.grid
    enough = loop_state(shape, Adviser(StoppingRule(3)).advice(shape))
    assert enough.goal is None and enough.done == 'max_views' and enough.scores is not None


def test_the_page_goes_on_with_a_shape_that_has_no_surface(shape):
    empty = replace(shape, grid=VoxelGrid(np.zeros_like(shape.occupancy), shape.size))
    page = WatchPage(0, 'http://127.0.0.1:1/word/')
    try:
        page._page._in_colors.value = True
        for each in (shape, empty, shape):
            page.draw(Progress(shape=each))
            assert (page._state.surface is None) == (each is empty)
    finally:
        page.close()


@pytest.mark.parametrize('address', ['http://192.168.1.17:43210/word/', ''])
def test_a_phone_is_invited_where_it_reaches_this_machine(address):
    page = WatchPage(0, address)
    try:
        page.draw(Progress())
        assert page._page._picture.visible == bool(address)
        assert ('phone' in page._page._text.content) == bool(address)
    finally:
        page.close()


def test_the_page_stays_in_colours_where_a_photo_is_left_out(shape):
    page = WatchPage(0, 'http://127.0.0.1:1/word/')
    try:
        page._page._in_colors.value = True
        for lines in (['3 photos.'], ['3 photos.', 'Left out: 9.jpg: no board seen in it']):
            page.draw(Progress(lines, shape))
            assert page._state.surface is not None
    finally:
        page.close()


def test_a_phone_reads_the_address_from_the_page():
    address = 'http://192.168.1.17:43210/abcdefghijklmnopqrstuv/'
    assert cv2.QRCodeDetector().detectAndDecode(qr_code(address))[0] == address


def test_the_loop_takes_photos_in_says_where_to_stand_and_has_a_result(posed, tmp_path, adviser):
    said = []
    watcher = Watcher(tmp_path, Collection(posed / 'transforms.json', Options()), adviser,
                      said.append)
    with pytest.raises(DataError, match='no shape: expected photos of an object'):
        watcher.result()
    assert not watcher.step(0.0)
    for number in range(3):
        shutil.copy(posed / f'photo{number}.png', tmp_path)
    (tmp_path / '9.jpg').write_bytes(b'no photo')
    watcher.step(1.0)
    assert sum(watcher.step(float(second)) for second in range(2, 6)) == 3  # of 1, 1 and 2 photos
    assert not watcher.step(9.0)
    assert [line for line in said if 'taken in' in line] == [
        f'photo{number}.png: taken in' for number in range(3)]
    assert watcher.verdicts.wait('photo1.png', 0) == ''
    assert watcher.verdicts.wait('9.jpg', 0).startswith('9.jpg: not readable')
    assert watcher.verdicts.wait('other', 0) is None
    lines = watcher.progress.lines
    assert lines[0].startswith('Next: ') and ' degrees' in lines[0]
    assert lines[1].startswith('3 photos; expected IoU ')
    assert lines[-1].startswith('Left out: 9.jpg: not readable')
    assert watcher.progress.sketch is not None and not watcher.progress.enough
    assert watcher.result().left_out == [lines[-1].removeprefix('Left out: ')]
    (tmp_path / '9.jpg').unlink()
    watcher.step(10.0)
    assert not watcher.result().left_out
    assert '9.jpg: gone from the folder' in said


def place_of(shape, goal):
    """Return where a goal stands in the world of the photos' cameras."""
    return (shape.world_from_object @ (*goal.camera.position, 1.0))[:3]


def test_a_place_that_is_skipped_is_told_no_more_also_after_further_photos(
        posed, tmp_path, adviser):
    said = []
    watcher = Watcher(tmp_path, Collection(posed / 'transforms.json', Options()), adviser,
                      said.append)
    watcher.skip()  # none is told yet
    for number in range(3):
        shutil.copy(posed / f'photo{number}.png', tmp_path)
    for second in range(6):
        watcher.step(float(second))
    first = place_of(watcher.progress.shape, watcher.progress.advice.goal)
    watcher.skip()
    watcher.skip()  # pressed twice
    assert watcher.step(6.0) and watcher.step(6.0) and not watcher.step(6.0)
    assert said.count('left out: that place; another one is looked for') == 1
    instead = watcher.progress
    shutil.copy(posed / 'photo3.png', tmp_path)
    watcher.step(7.0)
    assert watcher.step(8.0) and len(watcher.progress.shape.views) == 4
    for now in (instead, watcher.progress):
        away = place_of(now.shape, now.advice.goal) - first
        assert np.linalg.norm(away) > 0.4 * np.linalg.norm(first - now.shape.cube.centre)


def test_where_all_places_are_skipped_there_are_enough_photos(shape, adviser):
    skipped, advice = [], adviser.advice(shape)
    while advice.goal is not None:
        skipped.append(place_of(shape, advice.goal))
        advice = adviser.advice(shape, skipped)
    assert 5 < len(skipped) < 30
    assert told(shape, advice, True)[0] == 'Enough photos: there is no place left.'


def test_the_button_that_skips_a_place_waits_for_one(shape, adviser):
    page = WatchPage(0, '')
    try:
        button = page._page._buttons['Nobody can stand there']
        for progress in (Progress(), Progress(shape=shape, advice=adviser.advice(shape))):
            page.draw(progress)
            assert button.disabled != progress.has_goal
        assert not button.disabled and not page.skips()
    finally:
        page.close()


def test_photos_are_used_once_a_file_of_cameras_has_theirs(posed, tmp_path, adviser):
    said, whole, photos = [], (posed / 'transforms.json').read_text(), tmp_path / 'photos'
    photos.mkdir()
    written = photos / 'transforms.json'
    watcher = Watcher(photos, Collection(None, Options()), adviser, said.append)
    clock = iter(range(100))

    def used(photo, cameras):
        """Return how many photos are used after a photo came and the cameras were written."""
        if photo:
            shutil.copy(posed / photo, photos)
        else:
            written.write_text(cameras)
        for _ in range(4):
            watcher.step(float(next(clock)))
        shape = watcher._collection.shape
        return 0 if shape is None else len(shape.views)

    some = json.loads(whole)
    some['frames'] = some['frames'][:2]
    assert used('photo0.png', '') == 0
    assert watcher.progress.lines[0].startswith(
        f'Not enough yet: {photos}: no cameras beside the photos')
    assert used('photo1.png', '') == 0
    assert used('', json.dumps(some)) == 2
    assert used('photo2.png', '') == 2
    assert said[-3].startswith('left out: photo2.png: no camera in')
    assert used('', whole[:300]) == 2
    assert used('photo3.png', '') == 2
    assert used('', whole) == 4
    assert not watcher.result().left_out
    assert used('', whole[:300]) == 4  # as they were
    assert said[-3].startswith(f'the cameras have changed, and are not used: {written}: no cam')
    assert used('', whole) == 4 and said[-3] == 'the cameras have changed'


def test_a_photo_is_told_as_left_out_only_as_long_as_it_is(shape, adviser, tmp_path):
    others = [f'{name}: of another lens' for name in ('a.png', 'b.png')]
    used = {'a.png': ['a.png'], 'b.png': ['a.png'], 'c.png': ['b.png', 'c.png']}

    def add(path):  # of two lenses the first is that of the photos, until there are more others
        left_out = {'a.png': [], 'b.png': others[1:], 'c.png': others[:1]}[path.name]
        found.shape = replace(shape, left_out=left_out, views=[
            replace(shape.views[0], name=name) for name in used[path.name]])
        return ''.join(each for each in left_out if each.startswith(path.name))

    found = SimpleNamespace(add_all=lambda paths: list(map(add, paths)), count=0, shape=None,
                            remove=lambda *paths: None, metric=True, board=None, new_cameras=dict)
    watcher = Watcher(tmp_path, found, adviser, print)
    for number, name in enumerate(used):
        (tmp_path / name).write_bytes(b'any')
        for now in (2.0 * number, 2.0 * number + 1):
            watcher.step(now)
        assert watcher.result().left_out == found.shape.left_out


def test_where_the_original_is_deleted_its_copy_is_taken_in(photos, tmp_path, adviser):
    shutil.copy(photos[0], tmp_path / 'a.png')
    shutil.copy(photos[0], tmp_path / 'b.png')
    said = []
    watcher = Watcher(tmp_path, Collection(SOURCE, Options()), adviser, said.append)
    for now in range(4):
        watcher.step(float(now))
    assert 'left out: b.png: the same photo as a.png' in said
    (tmp_path / 'a.png').unlink()
    for now in range(4, 8):
        watcher.step(float(now))
    assert said.index('b.png: taken in') > said.index('a.png: gone from the folder')


def test_a_photo_that_is_written_anew_is_not_told_as_gone(tmp_path):
    said, photo = [], tmp_path / 'a.jpg'
    watcher = Watcher(tmp_path, Collection(SOURCE, Options()), None, said.append)
    watcher._tell = lambda: None
    for number in range(2):
        photo.write_bytes(b'no photo'[number:])
        for now in (2.0 * number, 2.0 * number + 1):
            watcher.step(now)
    photo.unlink()
    watcher.step(9.0)
    assert [line for line in said if 'left out' not in line] == [
        'a.jpg: changed', 'a.jpg: gone from the folder']


def test_photos_that_arrive_may_have_a_mask_or_none(posed, tmp_path):
    mask = np.zeros((180, 240), np.uint8)
    mask[60:120, 80:160] = 255
    Image.fromarray(mask).save(tmp_path / 'photo0.png')
    found = Collection(posed / 'transforms.json', Options(masks=tmp_path))
    for number in range(3):
        assert found.add(posed / f'photo{number}.png') == ''
    assert len(found.shape.views) == 3 and not found.shape.left_out


def test_while_the_folder_cannot_be_read_photos_neither_come_nor_go(tmp_path):
    folder, said = tmp_path / 'photos', []
    folder.mkdir()
    for name in ('a.jpg', 'b.jpg'):
        (folder / name).write_bytes(b'no photo')
    watcher = Watcher(folder, Collection(SOURCE, Options()), None, said.append)
    assert [watcher.step(now) for now in (0.0, 1.0)] == [False, True]  # b.jpg waits for its turn
    folder.rename(tmp_path / 'elsewhere')
    assert [watcher.step(now) for now in (2.0, 3.0)] == [False, False]
    assert said[-1] == (f'{folder}: cannot be read: No such file or directory; the photos so far '
                        'stay, and it is looked for again')
    assert len(said) == 3 and said[0].startswith('left out: a.jpg: not readable')
    (tmp_path / 'elsewhere').rename(folder)
    assert [watcher.step(now) for now in (4.0, 5.0)] == [True, False]
    assert said[3].startswith('left out: b.jpg: not readable') and 'identify' in said[3]


def test_ctrl_c_writes_the_products(photos, tmp_path, monkeypatch):
    folder = tmp_path / 'arriving'
    folder.mkdir()
    with_focal(photos[0], folder / '0.jpg')
    step = Watcher.step

    def interrupted(self, now):
        changed = step(self, now)
        if self.progress.shape is not None:
            signal.raise_signal(signal.SIGINT)
        return changed

    monkeypatch.setattr(Watcher, 'step', interrupted)
    done = CliRunner().invoke(app, [
        'reconstruct', str(folder), '--watch', '--board', '--squares', '9x7', '--port', '0',
        '--out', str(tmp_path / 'out')])
    assert done.exit_code == 0, done.output
    assert 'Next: ' in done.output and '1 photo; silhouettes: what covers' in done.output
    for name in ('mesh.ply', 'shape.json', 'picture.png'):
        assert (tmp_path / 'out' / name).stat().st_size > 1000
