"""`active-recon report`, as it is typed; what a bag holds is given, not read."""

from base64 import b64decode
from dataclasses import replace
import gzip
import json

from active_recon.bags.runs import reading
from active_recon.cli.main import app
from active_recon.errors import ConfigError, DataError
from active_recon.objects import find_object
from active_recon.report import page as page_module
import pytest
from report_runs import changed, recorded_run
from typer.testing import CliRunner

pytestmark = pytest.mark.usefixtures('loaded_once')


@pytest.fixture(scope='module')
def run(loaded_once):
    return recorded_run('chair', 'uniform', 2)


@pytest.fixture
def bags(tmp_path, monkeypatch, run):
    """Return two folders that are read as the same run, and the topics that were asked for."""
    asked = []

    def read_run(path, topics, scene):
        if not path.is_dir() and path.suffix != '.mcap':
            raise DataError(f'{path}: expected a bag')
        asked.append((topics, scene))
        return replace(run, path=path, parameters={})

    monkeypatch.setattr(reading, 'read_run', read_run)
    monkeypatch.setattr(page_module, 'colored_surface', lambda subject: None)
    for name in ('first', 'second'):
        (tmp_path / name).mkdir()
    return tmp_path / 'first', tmp_path / 'second', asked


def report(*arguments):
    """Run the command in this process; what the package refuses is raised."""
    result = CliRunner().invoke(app, ['report', *map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def drawn_in(path):
    packed = path.read_text().split('id="drawn">')[1].split('<')[0]
    return json.loads(gzip.decompress(b64decode(packed)))


def test_page_lies_in_the_bag_unless_it_is_told_otherwise(bags, tmp_path):
    result = report(bags[0])
    assert result.exit_code == 0
    assert f'wrote {bags[0] / "report.html"}' in result.stdout.replace('\n', '')
    report(bags[0], '--out', tmp_path / 'new' / 'page.html')
    assert (tmp_path / 'new' / 'page.html').read_bytes() == (
        bags[0] / 'report.html').read_bytes()


def test_pages_of_bags_that_are_files_of_one_folder_lie_beside_each_other(bags, tmp_path):
    for name in ('one', 'two'):
        (tmp_path / f'{name}.mcap').touch()
        assert report(tmp_path / f'{name}.mcap').exit_code == 0
    assert sorted(path.name for path in tmp_path.glob('*.html')) == ['one.html', 'two.html']


def test_every_bag_has_its_part_and_its_letter(bags, tmp_path):
    report(bags[0], bags[1], '--out', tmp_path / 'page.html')
    drawn = drawn_in(tmp_path / 'page.html')
    assert len(drawn['panels']) == 2
    assert [curve['name'] for curve in drawn['shared']['entropy']['data']] == ['A', 'B']


def test_truth_is_for_all_bags_or_for_each(bags, tmp_path):
    chair, car = find_object('chair'), find_object('car')
    page = tmp_path / 'page.html'

    def ious(*truths):
        options = [word for truth in truths for word in ('--truth', truth)]
        said = report(bags[0], bags[1], *options, '--out', page).stdout
        shown = [curve['y'] for curve in drawn_in(page)['shared']['iou']['data']]
        for letter, values in zip('AB', shown, strict=True):
            assert f'{letter}: IoU ' + ' '.join(f'{value:.2f}' for value in values) in said
        return shown

    one_for_all, each = ious(chair), ious(chair, car)
    assert one_for_all[0] == one_for_all[1] == each[0]
    assert each[1] != each[0]
    with pytest.raises(ConfigError, match='wrong number of files: .* one for each of 2, got 3'):
        ious(chair, chair, chair)


def test_only_the_episode_that_is_asked_for_is_shown(bags, tmp_path, monkeypatch, run):
    empty, first, second = replace(run.episodes[0], views=[]), run.episodes[0], replace(
        run.episodes[0], views=run.episodes[0].views[:1])
    several = replace(run, episodes=[empty, first, second])
    monkeypatch.setattr(reading, 'read_run', lambda _path, _topics, _scene: several)
    page = tmp_path / 'page.html'
    report(bags[0], '--out', page)
    assert len(drawn_in(page)['panels']) == 2  # those with views
    report(bags[0], '--out', page, '--episode', 3)
    [panel] = drawn_in(page)['panels']
    assert len(panel['scene']['grids']) == 1
    with pytest.raises(DataError, match='no episodes with views'):
        report(bags[0], '--out', page, '--episode', 1)
    with pytest.raises(ConfigError, match='has no episode 4: expected 1 to 3'):
        report(bags[0], '--out', page, '--episode', 4)


def test_bag_of_images_alone_gets_its_shapes_and_the_page_says_so(bags, tmp_path, monkeypatch,
                                                                  run):
    bare = changed(run, views=[replace(view, reconstruction=None, occupied=None, entropy=None)
                               for view in run.episodes[0].views])
    monkeypatch.setattr(reading, 'read_run', lambda _path, _topics, _scene: bare)
    report(bags[0], '--out', tmp_path / 'page.html')
    assert 'The bag has no reconstruction' in (tmp_path / 'page.html').read_text()
    assert None not in drawn_in(tmp_path / 'page.html')['panels'][0]['scene']['grids']


def test_topics_of_others_are_handed_on(bags):
    report(bags[0], '--image', '/wrist/image', '--azimuth', '/table', '--joint', 'disc',
           '--turned-object')
    [(topics, _)] = bags[2]
    assert (topics.image, topics.azimuth, topics.joint, topics.turned_object) == (
        '/wrist/image', '/table', 'disc', True)


def test_bag_that_cannot_be_read_leaves_no_page(bags, tmp_path):
    with pytest.raises(DataError, match='expected a bag'):
        report(bags[0], tmp_path / 'nothing', '--out', tmp_path / 'page.html')
    assert not (tmp_path / 'page.html').exists()
