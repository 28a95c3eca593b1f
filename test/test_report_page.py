"""The page as a file: whole, closed to the network, the same every time, and safe to open."""

from base64 import b64decode
from dataclasses import replace
import gzip
from html.parser import HTMLParser
from itertools import islice
import json
import math
import os
from pathlib import Path
import pickle
import re
import subprocess
import sys

from active_recon.bags.runs.run import TopicSummary
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.policies.reasons import GoalReason
from active_recon.report.page import MAX_SUBJECTS, report_page, write_page
from active_recon.report.scene import encoded, STEPS
from active_recon.report.subject import letters, object_of, Subject
from active_recon.report.truth import known_truth
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
from report_runs import changed, recorded_run

EVIL = '</script><script id="evil">alert(1)</script><b title=\'"&'


@pytest.fixture(scope='module')
def run():
    return recorded_run('chair', views=5)


@pytest.fixture(scope='module')
def page(run):
    return page_of(run)


@pytest.fixture(scope='module')
def shapeless(run):
    """Return the run without shapes: of its page the words alone are read."""
    return without_shapes(run)


def without_shapes(run):
    return changed(run, views=[replace(view, reconstruction=None, occupied=None)
                               for view in run.episodes[0].views])


def page_of(*runs):
    return report_page([Subject(letter, run, run.episodes[0],
                                getattr(known_truth(run), 'cells', None))
                        for letter, run in zip(letters(), runs, strict=False)])


class Elements(HTMLParser):
    """All start tags with their attributes, and what text is not in a script or a style."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text, self._inside = [], '', ''
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._inside = tag

    def handle_endtag(self, _tag):
        self._inside = ''

    def handle_data(self, data):
        self.text += '' if self._inside in ('script', 'style') else data


def drawn_in(page):
    """Return what the page's script draws from."""
    packed = page.split('id="drawn">')[1].split('<')[0]
    return json.loads(gzip.decompress(b64decode(packed)))


def test_elevations_are_told_where_they_differ_and_only_there(shapeless, page):
    views = [replace(view, camera=orbit_camera(view.camera.azimuth, 0.2 * number))
             for number, view in enumerate(shapeless.episodes[0].views)]
    told = Elements(page_of(changed(shapeless, views=views))).text
    for number in range(5):
        assert f'elevation {round(math.degrees(0.2 * number))}°' in told
    assert 'elevation ' not in Elements(page).text.replace('elevation of', '')


def with_reasons(run, reason):
    views = [replace(view, goal=view.goal and replace(view.goal, reason=reason))
             for view in run.episodes[0].views]
    return changed(run, views=views)


def test_each_view_says_why_it_was_asked_for(shapeless, page):
    reason = GoalReason('shows the top', 0.0421)
    told = Elements(page_of(with_reasons(shapeless, reason))).text
    assert told.count(reason.sentence) == len(shapeless.episodes[0].views) - 1  # not the first
    assert reason.sentence not in Elements(page).text


def test_page_of_five_views_is_small(page):
    assert len(page.encode()) < 6e6


def test_every_drawing_has_a_name_for_who_hears_the_page(page):
    drawings = re.findall(r'<div class="(?:scene|map|chart)"[^>]*>', page)
    assert len(drawings) == 5
    for drawing in drawings:
        assert 'role="img"' in drawing and re.search(r'aria-label="\w', drawing), drawing


def test_nothing_is_fetched(page):
    elements = Elements(page)
    for tag, attributes in elements.tags:
        for name in ('src', 'href', 'srcset', 'action', 'data'):
            assert attributes.get(name, 'data:').startswith('data:'), (tag, attributes)
    [policy] = [attributes['content'] for tag, attributes in elements.tags
                if attributes.get('http-equiv') == 'Content-Security-Policy']
    assert "default-src 'none'" in policy
    assert not any(word in policy for word in ('http', '*', 'connect-src'))


def test_same_run_gives_the_same_bytes_in_another_process_that_never_imports_torch(
        run, page, tmp_path):
    (tmp_path / 'run').write_bytes(pickle.dumps(run))
    code = ('import pickle, sys; from pathlib import Path; '
            'from active_recon.report.page import report_page; '
            'from active_recon.report.subject import Subject; '
            'from active_recon.report.truth import known_truth; '
            'run = pickle.loads(Path(sys.argv[1]).read_bytes()); '
            "page = report_page([Subject('A', run, run.episodes[0], known_truth(run).cells)]); "
            "sys.stdout.write(page); sys.exit('torch' in sys.modules)")
    other = subprocess.run([sys.executable, '-c', code, tmp_path / 'run'], capture_output=True,
                           check=True, text=True, env={
                               **os.environ, 'PYTHONPATH': os.pathsep.join(sys.path),
                               'PYTHONHASHSEED': '7'}).stdout
    assert other == page


def test_what_comes_from_a_bag_is_text_and_never_markup(run):
    run = changed(run, views=run.episodes[0].views[:2])
    evil = replace(
        changed(with_reasons(run, GoalReason(EVIL)), id=EVIL, done=EVIL),
        path=Path(EVIL.replace('/', '')),
        provenance={'policy': EVIL, 'object': EVIL, EVIL: EVIL},
        parameters={EVIL: {EVIL: EVIL}}, counters={EVIL: {f'refused/{EVIL}': 3}},
        topics=[TopicSummary(EVIL, EVIL, 1)])
    plain = replace(run, provenance={}, parameters={'a': {'b': 'c'}}, counters={'a': {'b': 1}},
                    topics=run.topics[:1])
    for count, bad, good in ((1, evil, plain), (2, without_shapes(evil), without_shapes(plain))):
        elements, clean = Elements(page_of(*[bad] * count)), Elements(page_of(*[good] * count))
        assert not any(attributes.get('id') == 'evil' for _, attributes in elements.tags)
        assert elements.text.count(EVIL) >= 9 * count
        scripts, honest = (sum(tag == 'script' for tag, _ in each.tags)
                           for each in (elements, clean))
        assert scripts == honest


def test_page_draws_just_what_was_recorded(run, page):
    panel = drawn_in(page)['panels'][0]['scene']
    for packed, view in zip(panel['grids'], run.episodes[0].views, strict=True):
        cells = np.frombuffer(b64decode(packed), '<u2').reshape([panel['side']] * 3) / 65535
        np.testing.assert_allclose(cells, view.reconstruction.occupancy, atol=1 / 65535)
        clear = np.abs(cells - panel['threshold']) > 1 / 65535
        occupied = view.occupied.occupied(0)
        assert ((cells > panel['threshold']) == occupied)[clear].all()


def test_figures_known_of_a_run_stand_on_its_page(run, page):
    text = Elements(page).text
    for word in (run.path.name, run.provenance['weights_sha256'], 'uniform', 'Chair',
                 '/camera/image_raw', 'goal_tolerance'):
        assert word in text


def test_several_runs_are_compared_in_a_table_with_a_row_each(run, shapeless):
    runs = [run, replace(shapeless, path=Path('another_bag')),
            replace(changed(shapeless, views=shapeless.episodes[0].views[:2]), path=Path('car'))]
    elements = Elements(page_of(*runs))
    assert sum(tag == 'article' for tag, _ in elements.tags) == 3
    assert all(run.path.name in elements.text for run in runs)
    assert 'side by side' in elements.text
    assert 'view limit' in elements.text


def of_photos(run, count=5):
    views = [replace(view, goal=None) for view in run.episodes[0].views[:count]]
    return replace(changed(run, views=views, first_goal=None, done='photos'),
                   provenance={**run.provenance, 'object': 'photos', 'policy': ''},
                   parameters={}, counters={})


def test_a_page_of_photos_says_what_they_are_and_tells_of_no_planner(shapeless, page):
    told = Elements(page_of(of_photos(shapeless))).text
    assert 'This run was made of 5 photos with known cameras.' in told
    assert 'An object, rebuilt from 5 views' in told
    assert 'It ended with the last photo.' in told
    for word in ('planner', 'goals', 'stopped', 'receive times'):
        assert word not in told
    assert 'Not recorded: the bag is without the loop’s times.' in told
    assert 'This run was made of 1 photo with a known camera.' in Elements(
        page_of(of_photos(shapeless, 1))).text
    other = Elements(page).text
    assert 'a planner chose the next view. This page shows that run.' in other
    assert 'photo' not in other


def test_a_page_of_several_runs_tells_which_of_them_are_of_photos(shapeless):
    photos = of_photos(shapeless)
    assert 'Each letter below is a run made of photos with known cameras.' in Elements(
        page_of(photos, photos)).text
    mixed = Elements(page_of(shapeless, photos, photos)).text
    assert 'Each letter below is one such run, but B, C were made of photos' in mixed
    assert 'Each letter below is one such run.' in Elements(page_of(shapeless, shapeless)).text


def test_a_page_of_a_sweep_tells_of_no_planner_that_chose_or_stopped(shapeless):
    views = [replace(view, goal=None) for view in shapeless.episodes[0].views]
    sweep = changed(shapeless, views=views, first_goal=None, done='')
    told = Elements(page_of(sweep)).text
    assert 'No planner was recorded' in told
    assert 'a planner chose' not in told
    assert 'The turntable from above' in told and 'goals' not in told
    compared = Elements(page_of(shapeless, sweep)).text
    assert 'no planner' in compared and 'no end recorded' not in compared


def test_bag_with_hardly_anything_in_it_still_gives_a_page(run):
    bare = [replace(view, reconstruction=None, occupied=None, latent=None, entropy=None, goal=None,
                    received={}) for view in run.episodes[0].views[:1]]
    stranger = replace(changed(run, views=bare, first_goal=None, id='', done=''), provenance={},
                       parameters={}, counters={}, topics=[], begin=0, end=0)
    page = page_of(stranger)
    assert 'An object, rebuilt from 1 view' in page
    assert 'without the loop' in page
    assert 'data-own="stages"' not in page


def test_figure_that_is_not_finite_is_left_out(run):
    views = [replace(view, entropy=math.nan, goal=view.goal and replace(
        view.goal, scores=np.full(24, np.nan, np.float32))) for view in run.episodes[0].views]
    page = page_of(changed(run, views=views))
    json.dumps(drawn_in(page), allow_nan=False)
    assert 'nan' not in Elements(page).text
    first = run.episodes[0].first_goal
    astray = replace(first.candidates, azimuths=np.full_like(first.candidates.azimuths, np.nan))
    page = page_of(changed(run, first_goal=replace(first, candidates=astray)))
    json.dumps(drawn_in(page), allow_nan=False)


def test_a_shape_without_any_doubt_has_an_entropy_of_0_and_not_of_minus_0(run):
    sure = VoxelGrid(np.ones((2, 2, 2), np.float32)).entropy()
    views = [replace(view, entropy=sure) for view in without_shapes(run).episodes[0].views]
    text = Elements(page_of(changed(run, views=views))).text
    assert '0 nats' in text and '-0 nats' not in text


def test_no_episode_and_too_many_are_refused(run):
    with pytest.raises(DataError, match='no episodes with views'):
        report_page([])
    with pytest.raises(ConfigError, match=f'at most {MAX_SUBJECTS}'):
        report_page([Subject('A', run, run.episodes[0])] * (MAX_SUBJECTS + 1))


def test_page_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / 'deep' / 'page.html'
    write_page('first', path)
    assert path.read_text() == 'first'

    def full(_self, _target):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(Path, 'replace', full)
    with pytest.raises(DataError, match='No space left'):
        write_page('second', path)
    assert path.read_text() == 'first'
    assert [each.name for each in path.parent.iterdir()] == ['page.html']


def test_a_name_that_is_not_of_utf8_is_on_the_page_as_far_as_it_can_be(tmp_path):
    write_page('gr\udcfcn', tmp_path / 'page.html')
    assert (tmp_path / 'page.html').read_text() == 'gr?n'


def test_an_object_keeps_the_capitals_of_its_file(shapeless):
    named = replace(shapeless, provenance={**shapeless.provenance, 'object': 'lampA2.ply'})
    for count in (1, 2):
        assert '>LampA2' in page_of(*[named] * count)


@pytest.mark.parametrize(('recorded', 'name'), [
    ('my.part.v2.stl', 'my.part.v2'), ('tools/my.part.v2', 'tools/my.part.v2'),
    ('no.1/mug', 'no.1/mug'), ('photos', 'photos'), ('', '')])
def test_only_the_suffix_of_a_mesh_file_is_no_part_of_the_name_of_an_object(
        run, recorded, name):
    shown = replace(run, provenance={**run.provenance, 'object': recorded})
    assert object_of(shown, shown.episodes[0]) == name


def test_letters_go_on_beyond_the_alphabet():
    every = list(islice(letters(), 2000))
    assert every[:2] == ['A', 'B']
    assert every[25:28] == ['Z', 'AA', 'AB'] and every[701:703] == ['ZZ', 'AAA']
    assert len(set(every)) == 2000


def test_the_surface_on_the_page_is_the_last_one_in_its_colours(run, page):
    surface = drawn_in(page)['panels'][0]['surface']
    corners, faces, colors = (
        np.frombuffer(b64decode(surface[name]), kind).reshape(-1, 3)
        for name, kind in (('corners', '<u2'), ('faces', '<u4'), ('colors', 'u1')))
    subject = Subject('A', run, run.episodes[0])
    grid = run.episodes[0].views[-1].reconstruction
    mesh = grid.mesh(subject.threshold)
    np.testing.assert_allclose(2 * (corners / 65535 - 0.5) * grid.size, mesh.vertices, atol=1e-4)
    np.testing.assert_array_equal(faces, mesh.faces)
    assert len(colors) == len(corners)
    assert colors.std(axis=0).max() > 1
    assert 'value="colors"' in page


def test_a_page_without_a_surface_offers_no_colours(run):
    views = [replace(view, reconstruction=None, occupied=None) for view in run.episodes[0].views]
    bare = page_of(changed(run, views=views))
    assert drawn_in(bare)['panels'][0]['surface'] is None
    assert 'value="colors"' not in bare


def test_every_occupancy_on_the_page_keeps_to_its_side_of_the_threshold():
    threshold = 0.4179
    near = np.float32(threshold) + np.arange(-40, 41, dtype=np.float32) * np.float32(3e-8)
    occupancy = np.concatenate([near, np.float32([0, threshold, 1])])
    steps = np.frombuffer(b64decode(encoded(occupancy, threshold)), '<u2')
    np.testing.assert_array_equal(steps > threshold * STEPS, occupancy > threshold)
    assert np.abs(steps / STEPS - occupancy).max() <= 1 / STEPS
