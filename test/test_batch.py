"""An archive of bags becomes one table and one page, whatever single bags do."""

from base64 import b64decode
from dataclasses import replace
import errno
import gzip
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys

from active_recon.bags.runs.loop_setup import Overrides
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.batch import task as task_module
from active_recon.batch import work
from active_recon.batch.finding import bags_below, find_roots
from active_recon.batch.results import BagResult
from active_recon.batch.rows import COLUMNS, refusal_row
from active_recon.batch.summary import MOST_SHOWN, Summary
from active_recon.batch.table import read_table, write_table
from active_recon.batch.task import Task, TruthSource
from active_recon.errors import ConfigError, DataError
from active_recon.interrupts import interrupt
from active_recon.reconstructor import Reconstructor
from active_recon.report.findings import stopped
from command_line import command, refusal
from foreign_recordings import images, joints
from loop_bags import write_bag
import pytest
import trimesh
import yaml

ROOT = Path(__file__).parents[1]
PAPER = ROOT / 'bags' / 'golden' / 'paper'
pytestmark = pytest.mark.usefixtures('loaded_once')


@pytest.fixture
def archive(tmp_path):
    """Return a folder of three bags and a file that is none."""
    for name in ('a', 'b/deep', 'c'):
        shutil.copytree(PAPER, tmp_path / 'archive' / name)
    (tmp_path / 'archive' / 'b' / 'broken.mcap').write_bytes(b'no bag')
    return tmp_path / 'archive'


def batch(monkeypatch, kind, archive, out, *more):
    assert command(monkeypatch, 'batch', kind, archive, '--out', out, '--workers', 1, *more) == 0
    return list(read_table(out / 'table.parquet'))


def bags_of(rows):
    return [Path(row['bag']).name for row in rows]


def row_of(number, **values):
    return {**dict.fromkeys(COLUMNS), 'bag': f'{number}.mcap', 'refused': '', 'refused_kind': '',
            'episode': 1, 'views': 4, 'stopped': 'max_views', 'verdict': '', 'warnings': [],
            'object': 'chair', 'policy': 'uniform', 'report': '', **values}


def test_bags_of_a_tree_are_found_once_and_in_order(tmp_path):
    for name in ('z.mcap', 'b/metadata.yaml', 'b/b_0.mcap', 'split/split_0.mcap',
                 'split/split_1.mcap', 'day/day_0.db3', 'day/day_1.db3', 'loose/x.db3',
                 'loose/y.mcap', 'loose/notes.txt', 'loose/.y.mcap.part', 'empty/readme'):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = [str(path.relative_to(tmp_path)) for path in bags_below(tmp_path)]
    assert found == ['b', 'day', 'loose/x.db3', 'loose/y.mcap', 'split', 'z.mcap']
    inside = [str(tmp_path / 'loose'), str(tmp_path / 'loose' / 'y.mcap'), tmp_path.as_uri()]
    assert find_roots(inside) == [tmp_path]
    assert find_roots([str(tmp_path / '**' / '*.db3')]) == [
        tmp_path / 'day', tmp_path / 'loose' / 'x.db3']
    for pattern, roots in (('split/*.mcap', ['split']), ('b/*', ['b']), ('**/*_1.mcap', ['split']),
                           ('loose/*', ['loose/x.db3', 'loose/y.mcap'])):  # parts are one bag
        assert find_roots([str(tmp_path / pattern)]) == [tmp_path / each for each in roots]
    for pattern in ('*.bag', 'loose/*.txt'):
        with pytest.raises(DataError, match='no bags there'):
            find_roots([str(tmp_path / pattern)])
    with pytest.raises(ConfigError, match='ftp://fleet/day: no such storage'):
        find_roots(['ftp://fleet/day'])


def test_what_a_killed_command_leaves_of_a_bag_is_none(tmp_path):
    killed = subprocess.run([sys.executable, '-c', f"""
import os, pathlib, signal
from active_recon.bags.storage.atomic_bag import atomic_bag
with atomic_bag(pathlib.Path({str(tmp_path / 'what_if')!r})):
    os.kill(os.getpid(), signal.SIGKILL)
"""], cwd=ROOT, check=False)
    assert killed.returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.rglob('*.mcap')] == ['what_if_0.mcap']
    assert list(bags_below(tmp_path)) == []


def test_a_bag_that_cannot_be_read_is_a_row_and_changes_no_other(
        archive, tmp_path, monkeypatch):
    rows = batch(monkeypatch, 'measure', archive, tmp_path / 'with')
    assert bags_of(rows) == ['a', 'broken.mcap', 'deep', 'c']
    assert rows[1]['refused_kind'] == 'data' and 'no readable rosbag2 bag' in rows[1]['refused']
    (archive / 'b' / 'broken.mcap').unlink()
    without = batch(monkeypatch, 'measure', archive, tmp_path / 'without')
    assert without == [rows[0], *rows[2:]]
    assert all(row['views'] == 4 and row['stopped'] == 'max_views' and 0.5 < row['iou'] < 0.7
               for row in without)


def test_the_command_says_of_the_first_refused_bags_why_they_are(tmp_path, monkeypatch, capsys):
    for number in range(7):
        (tmp_path / f'{number}.mcap').write_bytes(b'no bag')
    assert command(monkeypatch, 'batch', 'measure', tmp_path, '--out', tmp_path / 'out',
                   '--workers', 1) == 2  # all are refused
    *first, last = [line for line in capsys.readouterr().err.splitlines()
                    if line.startswith('refused: ')]
    assert first == [f'refused: {row["refused"]}'
                     for row in read_table(tmp_path / 'out' / 'table.parquet')][:5]
    assert all(f'/{number}.mcap: ' in line for number, line in enumerate(first))
    assert last == 'refused: 2 more; table.parquet and summary.html tell why'


def test_a_match_that_is_gone_is_refused_by_itself(archive, tmp_path, monkeypatch):
    (archive / 'gone.mcap').symlink_to('nowhere.mcap')
    there, gone = batch(monkeypatch, 'measure', archive / '[cg]*', tmp_path / 'out')
    assert bags_of([there, gone]) == ['c', 'gone.mcap']
    assert there['views'] == 4
    assert 'gone.mcap: no bag there' in gone['refused']


def test_a_folder_that_cannot_be_read_is_refused_by_itself(archive, tmp_path, monkeypatch):
    locked = archive / 'b' / 'lost+found'
    locked.mkdir()

    def denied(look):
        def looked(path):
            if str(path) == str(locked):
                raise PermissionError(errno.EACCES, 'Permission denied', str(path))
            return look(path)
        return looked

    monkeypatch.setattr(os, 'scandir', denied(os.scandir))
    monkeypatch.setattr(Path, 'iterdir', denied(Path.iterdir))
    rows = batch(monkeypatch, 'measure', archive / 'b', tmp_path / 'out')
    assert bags_of(rows) == ['broken.mcap', 'deep', 'lost+found']
    assert rows[2]['refused_kind'] == 'file' and 'Permission denied' in rows[2]['refused']


@pytest.mark.slow
def test_a_row_of_a_bag_without_shapes_names_the_weights_that_made_them(tmp_path, monkeypatch):
    folder = write_bag(tmp_path / 'run', images() + joints())
    (row,) = batch(monkeypatch, 'measure', folder, tmp_path / 'out')
    assert row['weights_sha256'] == Reconstructor.load().provenance['weights_sha256']


def test_an_episode_that_ended_before_its_first_view_has_a_row_too(tmp_path, monkeypatch):
    run = read_run(PAPER)
    [whole] = run.episodes
    assert whole.first_goal is not None
    both = replace(run, episodes=[whole, replace(whole, views=[])])
    monkeypatch.setattr(work, 'read_run', lambda *_: both)
    rows = work.rows_of(Task('report', tmp_path, Topics(), Scene()), PAPER)
    assert [row['views'] for row in rows] == [len(whole.views), 0]


def test_an_episode_without_a_planner_is_not_told_to_lack_its_end(tmp_path, monkeypatch):
    run = read_run(PAPER)
    [whole] = run.episodes
    sweep = replace(whole, first_goal=None, done='', views=[
        replace(view, goal=None) for view in whole.views])
    cut_off = replace(whole, done='')
    monkeypatch.setattr(work, 'read_run', lambda *_: replace(run, episodes=[sweep, cut_off]))
    rows = work.rows_of(Task('report', tmp_path, Topics(), Scene()), PAPER)
    assert [stopped(row['stopped']) for row in rows] == ['no planner', 'no end recorded']


def test_the_verdict_of_an_episode_is_not_that_of_another(tmp_path, monkeypatch):
    run = read_run(PAPER)
    [whole] = run.episodes
    wrong = replace(whole, begin=whole.begin + 1, views=[
        replace(view, entropy=2 * view.entropy) for view in whole.views])
    both = replace(run, episodes=[whole, wrong])
    monkeypatch.setattr(work, 'read_run', lambda *_: both)
    rows = work.rows_of(Task('replay', tmp_path, Topics(), Scene()), PAPER)
    assert rows[0]['verdict'] in ('same bits', 'within tolerance')
    assert rows[1]['verdict'] == 'different'


def test_every_episode_of_a_long_bag_has_a_row(tmp_path, monkeypatch):
    run = read_run(PAPER)
    many = replace(run, episodes=[replace(run.episodes[0], views=[])] * 800)
    monkeypatch.setattr(work, 'read_run', lambda *_: many)
    task = Task('report', tmp_path, Topics(), Scene())
    assert [row['episode'] for row in work.rows_of(task, PAPER)] == [*range(1, 801)]


@pytest.mark.slow
def test_a_truth_that_is_fitted_turns_with_the_yaw_that_is_told(tmp_path, monkeypatch):
    folder = write_bag(tmp_path / 'run', images() + joints())
    bar, turned_bar = tmp_path / 'bar.ply', tmp_path / 'turned.ply'
    trimesh.creation.box((1, 0.1, 0.1)).export(bar)
    trimesh.creation.box((0.1, 1, 0.1)).export(turned_bar)
    turned, placed = (batch(monkeypatch, 'measure', folder, tmp_path / f'out-{truth[0].stem}',
                            '--object-yaw-deg', 90, '--truth', *truth)[0]['iou']
                      for truth in ((bar, '--fit'), (turned_bar,)))
    assert turned == placed > 0


def test_only_the_first_episode_of_a_dataset_s_camera_is_of_the_object_that_the_bag_names(
        tmp_path, monkeypatch):
    run = read_run(PAPER)
    [first] = run.episodes
    shown = replace(run, episodes=[first, replace(first)],
                    provenance={**run.provenance, 'object': 'seat/one'},
                    parameters={'turntable_camera': {'dataset': 'seats'}})
    monkeypatch.setattr(work, 'read_run', lambda *_: shown)
    (tmp_path / 'seat').mkdir()
    trimesh.creation.box((0.5, 0.5, 0.5)).export(tmp_path / 'seat' / 'one.ply')
    task = Task('measure', tmp_path, Topics(), Scene(), truth=TruthSource(tmp_path))
    one, another = work.rows_of(task, PAPER)
    assert (one['object'], another['object']) == ('seat/one', '')
    assert one['iou'] > 0 and another['iou'] is None


def test_a_second_start_keeps_what_is_finished_and_unchanged(
        archive, tmp_path, monkeypatch, capsys):
    first = batch(monkeypatch, 'measure', archive, tmp_path / 'out')
    table = (tmp_path / 'out' / 'table.parquet').read_bytes()
    done = []
    rows_of = work.rows_of
    monkeypatch.setattr(work, 'rows_of', lambda task, bag: done.append(bag.name) or rows_of(
        task, bag))
    assert batch(monkeypatch, 'measure', archive, tmp_path / 'out') == first
    assert not done
    assert '4 of them finished before; 1 refused' in capsys.readouterr().out
    os.utime(next((archive / 'c').glob('*.mcap')), ns=(1, 1))
    next((tmp_path / 'out' / 'results').rglob('*.json')).write_text('{"state": ')  # torn
    assert batch(monkeypatch, 'measure', archive, tmp_path / 'out') == first
    assert 'c' in done and len(done) <= 2
    assert (tmp_path / 'out' / 'table.parquet').read_bytes() == table
    batch(monkeypatch, 'measure', archive, tmp_path / 'out', '--truth', 'sofa')
    assert len(done) >= 5  # another option: all again


def test_what_is_kept_is_of_the_same_weights_and_what_lies_beside_them(tmp_path):
    weights = tmp_path / 'mine.safetensors'
    weights.write_bytes(b'weights')

    def identity():
        return Task('measure', tmp_path, Topics(), Scene(), Overrides(weights)).identity

    known = [identity(), identity()]
    assert known[0] == known[1]
    for name in ('mine-quality.json', 'mine-scorer.safetensors', 'mine-depth.safetensors'):
        for content in (b'first', b'fitted anew'):
            (tmp_path / name).write_bytes(content)
            assert identity() not in known
            known.append(identity())


def test_what_is_kept_of_a_policy_of_an_installed_package_is_that_of_its_code(
        tmp_path, monkeypatch):
    monkeypatch.setattr(task_module, 'policy_code', lambda name, options: code)
    task = Task('replay', tmp_path, Topics(), Scene(), Overrides(policy='random'))
    code = 'one'
    before = task.identity
    code = 'another'
    assert task.identity != before


def test_a_fault_of_the_program_refuses_its_bag_alone(archive, tmp_path, monkeypatch):
    rows_of = work.rows_of
    monkeypatch.setattr(work, 'rows_of', lambda task, bag: 1 / 0 if bag.name == 'a' else rows_of(
        task, bag))
    first, *others = batch(monkeypatch, 'measure', archive, tmp_path / 'out')
    assert first['refused_kind'] == 'unexpected'
    assert first['refused'].endswith('a: ZeroDivisionError: division by zero')
    assert [row['refused_kind'] for row in others] == ['data', '', '']


def test_a_bag_that_found_too_little_memory_is_tried_again(archive, tmp_path, monkeypatch):
    rows_of = work.rows_of

    def short_of_memory(task, bag):
        if bag.name == 'a':
            raise MemoryError
        return rows_of(task, bag)

    monkeypatch.setattr(work, 'rows_of', short_of_memory)
    first, *_ = batch(monkeypatch, 'measure', archive, tmp_path / 'out')
    assert 'a: MemoryError' in first['refused']
    monkeypatch.setattr(work, 'rows_of', rows_of)
    first, *_ = batch(monkeypatch, 'measure', archive, tmp_path / 'out')
    assert not first['refused']


def test_a_bag_whose_work_was_interrupted_is_not_kept_as_refused(archive, tmp_path, monkeypatch):
    def interrupted(task, bag):
        try:
            interrupt(signal.SIGTERM, None)
        except KeyboardInterrupt:
            raise ValueError('what a library makes of it') from None

    monkeypatch.setattr('active_recon.interrupts._is_interrupted', False)  # and so again after
    monkeypatch.setattr(work, 'rows_of', interrupted)
    assert command(monkeypatch, 'batch', 'measure', archive, '--out', tmp_path / 'out',
                   '--workers', 1) == 130
    assert not list((tmp_path / 'out').rglob('*.json'))


def test_a_file_in_the_place_of_the_folder_is_told_in_one_line(
        archive, tmp_path, monkeypatch, capsys):
    (tmp_path / 'out').write_text('a file')
    said = refusal(monkeypatch, capsys, 'batch', 'measure', archive, '--out', tmp_path / 'out',
                   '--workers', 1)
    assert 'out: not written: expected a folder, got: ' in said


def test_a_full_disk_stops_with_one_line_and_a_second_start_does_the_rest(
        archive, tmp_path, monkeypatch, capsys):
    write, written = BagResult.write, []

    def until_full(self, out, bag):
        if len(written) == 2:
            raise OSError(errno.ENOSPC, 'No space left on device')
        written.append(bag)
        write(self, out, bag)

    monkeypatch.setattr(BagResult, 'write', until_full)
    said = refusal(monkeypatch, capsys, 'batch', 'measure', archive, '--out', tmp_path / 'out',
                   '--workers', 1)
    assert 'no room to write' in said and 'start again' in said
    monkeypatch.setattr(BagResult, 'write', write)
    assert len(batch(monkeypatch, 'measure', archive, tmp_path / 'out')) == 4
    assert '2 of them finished before' in capsys.readouterr().out


def test_a_command_ends_as_it_should_where_another_wrote_to_the_same_folder_meanwhile(
        archive, tmp_path, monkeypatch):
    rows_of = work.rows_of

    def meanwhile(task, bag):
        if bag.name == 'a':
            batch(monkeypatch, 'measure', archive / 'c', tmp_path / 'out')
        return rows_of(task, bag)

    monkeypatch.setattr(work, 'rows_of', meanwhile)
    rows = batch(monkeypatch, 'measure', archive, tmp_path / 'out')
    assert bags_of(rows) == ['a', 'broken.mcap', 'deep', 'c']
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == [
        'results', 'summary.html', 'table.parquet']


def test_a_report_of_each_bag_is_linked_from_the_page(tmp_path, monkeypatch):
    (row,) = batch(monkeypatch, 'report', PAPER, tmp_path / 'out')
    page = (tmp_path / 'out' / 'summary.html').read_text()
    (link,) = re.findall(r'href="(reports/[^"]+)"', page)
    assert link == row['report'] and 'Plotly' in (tmp_path / 'out' / link).read_text()
    (tmp_path / 'out' / link).unlink()
    batch(monkeypatch, 'report', PAPER, tmp_path / 'out')  # a page that is gone is made again
    assert 'Plotly' in (tmp_path / 'out' / link).read_text()
    assert 'https://' not in page.partition('<script type')[0]


def test_a_bag_whose_name_is_not_of_utf8_has_its_report(tmp_path, monkeypatch):
    bag = shutil.copytree(PAPER, tmp_path / 'bags' / os.fsdecode(b'a\xff'))
    (row,) = batch(monkeypatch, 'report', bag.parent, tmp_path / 'out')
    assert not row['refused'] and 'a?' in (tmp_path / 'out' / row['report']).read_text()


def test_a_replay_tells_whether_it_agrees_and_what_would_have_been(tmp_path, monkeypatch):
    (row,) = batch(monkeypatch, 'replay', PAPER, tmp_path / 'replayed')
    assert row['verdict'] in ('same bits', 'within tolerance')
    (other,) = batch(monkeypatch, 'replay', PAPER, tmp_path / 'other', '--threshold', 0.9)
    assert not other['verdict'] and other['iou'] != row['iou']
    assert other['entropy'] == row['entropy']  # the probabilities are the same


def test_the_same_rows_give_the_same_table_whatever_their_number(tmp_path):
    rows = [row_of(number, iou=number / 20_000) for number in range(12_001)]
    for name in ('one', 'two'):
        write_table(iter(rows), tmp_path / name)
    assert (tmp_path / 'one').read_bytes() == (tmp_path / 'two').read_bytes()
    assert [row['iou'] for row in read_table(tmp_path / 'one')] == [row['iou'] for row in rows]


def test_the_page_shows_the_lowest_quality_first_and_tells_what_it_leaves_out(tmp_path):
    summary = Summary()
    rows = [row_of(number, iou=0.9 - number / 10_000) for number in range(MOST_SHOWN + 7)]
    rows += [refusal_row(f'bad-{number}.mcap', 'no <bag>', 'data') for number in range(3)]
    assert len(list(summary.counting(rows))) == len(rows)
    summary.write(tmp_path / 'page.html', 'measure')
    page = (tmp_path / 'page.html').read_text()
    shown = [int(number) for number in re.findall(r'>(\d+)\.mcap<', page)]
    assert shown == list(range(MOST_SHOWN + 6, 6, -1))
    assert '7 more are in the table alone' in page
    assert 'no &lt;bag&gt;' in page and '3 bags refused' in page


def test_a_reason_on_the_page_of_an_archive_is_text_and_never_markup(tmp_path):
    summary = Summary()
    list(summary.counting([row_of(1, stopped='<a href="https://other">b</a> & c')]))
    summary.write(tmp_path / 'page.html', 'measure')
    page = (tmp_path / 'page.html').read_text()
    charts = gzip.decompress(b64decode(page.split('id="charts">')[1].split('<')[0])).decode()
    assert '&lt;a href=' in charts and '&amp; c' in charts  # Plotly takes texts for HTML
    assert '<a' not in charts and '<a href="https' not in page


def test_the_documentation_has_every_column():
    page = (ROOT / 'doc' / 'cluster.md').read_text()
    assert all(f'| `{name}` | {kind} | {meaning} |' in page
               for name, (kind, meaning) in COLUMNS.items())


def test_the_manifest_of_kubernetes_has_what_kuberay_requires():
    """Offline: what its schema requires, and that names agree; it has not run on a cluster."""
    job = yaml.safe_load((ROOT / 'examples' / 'cluster' / 'rayjob.yaml').read_text())
    assert (job['apiVersion'], job['kind']) == ('ray.io/v1', 'RayJob') and job['metadata']['name']
    spec = job['spec']['rayClusterSpec']
    groups = [spec['headGroupSpec'], *spec['workerGroupSpecs']]
    for group in groups:
        pod = group['template']['spec']
        (container,) = pod['containers']
        assert isinstance(group['rayStartParams'], dict)
        assert all(isinstance(value, str) for value in group['rayStartParams'].values())
        assert container['name'] and container['image']
        assert container['resources']['limits'] == container['resources']['requests']
        volumes = {volume['name'] for volume in pod['volumes']}
        assert {mount['name'] for mount in container['volumeMounts']} <= volumes
        assert {mount['mountPath'] for mount in container['volumeMounts']} == {'/data'}
    assert all(group['groupName'] and group['minReplicas'] <= group['replicas']
               <= group['maxReplicas'] for group in spec['workerGroupSpecs'])
    command = shlex.split(job['spec']['entrypoint'])
    assert command[:3] == ['active-recon', 'batch', 'measure']
    assert command[-2:] == ['--cluster', 'auto']


def test_the_script_for_slurm_is_a_shell_script():
    script = ROOT / 'examples' / 'cluster' / 'slurm.sh'
    subprocess.run(['bash', '-n', script], check=True)
