"""Large work on a Ray cluster: what is killed in the middle, and what is large."""

from contextlib import nullcontext
from dataclasses import replace
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

from active_recon.batch.table import read_table
from active_recon.cluster import crew_of
from active_recon.paper.parts import run_part
from paper_study import make_study, small_objects
import pytest
from ray_clusters import ray_client_server, ray_cluster, ROOT
from test_cluster import same_files

pytestmark = pytest.mark.slow
RUNNING: list[subprocess.Popen] = []
PAPER = ROOT / 'bags' / 'golden' / 'paper'


@pytest.fixture
def cluster():
    with ray_cluster() as started:
        yield started


def archive_of(folder, count):
    """Make an archive of as many bags, which share the bytes of one."""
    for number in range(count):
        bag = folder / f'{number // 100:03d}' / f'{number:06d}'
        bag.mkdir(parents=True)
        for file in PAPER.iterdir():
            os.link(file, bag / file.name)
    return folder


@pytest.fixture
def linked(tmp_path):
    """Return what makes an archive, of bags on the file system of the test."""
    shutil.copytree(PAPER, tmp_path / 'bag')

    def make(count):
        return archive_of(tmp_path / 'archive', count)

    return make


@pytest.fixture(autouse=True)
def none_left():
    """End what a failed test has left."""
    yield
    while RUNNING:
        process = RUNNING.pop()
        process.kill()
        process.communicate()


def started(*arguments):
    process = subprocess.Popen(
        [sys.executable, '-P', '-m', 'active_recon.cli.main', *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    RUNNING.append(process)
    return process


def said(process):
    out, _ = process.communicate(timeout=900)
    RUNNING.remove(process)
    assert process.returncode == 0, out
    return out


def wait_for_results(out, count):
    """Wait until so many bags are finished; return their results' files and times."""
    end = time.monotonic() + 300
    while time.monotonic() < end:
        found = {path: path.stat().st_mtime_ns for path in (out / 'results').rglob('*.json')}
        if len(found) >= count:
            return found
        time.sleep(0.05)
    raise AssertionError(f'expected {count} results in {out}, got {len(found)}')


def local_table(archive, out):
    said(started('batch', 'measure', archive, '--out', out, '--workers', 2))
    return (out / 'table.parquet').read_bytes()


def test_a_machine_that_dies_in_the_middle_loses_and_doubles_nothing(cluster, linked, tmp_path):
    archive = linked(40)
    driver = started('batch', 'measure', archive, '--out', tmp_path / 'ray', '--cluster',
                     cluster.address)
    wait_for_results(tmp_path / 'ray', 8)
    for processes in next(iter(cluster.worker_nodes)).all_processes.values():
        for each in processes:
            each.process.kill()
    assert '40 bags' in said(driver)
    bags = [row['bag'] for row in read_table(tmp_path / 'ray' / 'table.parquet')]
    assert len(bags) == len(set(bags)) == 40
    assert local_table(archive, tmp_path / 'local') == (
        tmp_path / 'ray' / 'table.parquet').read_bytes()


@pytest.mark.parametrize('kind', ['local', 'ray'])
def test_a_driver_that_is_killed_goes_on_where_it_was(kind, cluster, linked, tmp_path):
    archive, out = linked(120), tmp_path / 'out'
    arguments = ['batch', 'measure', archive, '--out', out, *(
        ['--cluster', cluster.address] if kind == 'ray' else ['--workers', 2])]
    driver = started(*arguments)
    before = wait_for_results(out, 20)
    driver.send_signal(signal.SIGKILL)
    with pytest.raises(AssertionError):
        said(driver)
    assert not (out / 'table.parquet').exists()
    assert 'of them finished before' in said(started(*arguments))
    assert all(path.stat().st_mtime_ns == when for path, when in before.items())
    assert local_table(archive, tmp_path / 'local') == (out / 'table.parquet').read_bytes()


def test_a_driver_outside_of_the_cluster_gets_the_same_over_ray_client(
        cluster, linked, tmp_path):
    archive = linked(6)
    (archive / '000' / 'x.mcap').write_bytes(b'no bag')
    with ray_client_server(cluster) as address:
        assert '7 bags' in said(started('batch', 'measure', archive, '--out', tmp_path / 'ray',
                                        '--cluster', address))
    local_table(archive, tmp_path / 'local')
    assert same_files(tmp_path / 'local', tmp_path / 'ray')


def test_one_poisonous_bag_among_a_thousand_is_refused_alone(cluster, linked, tmp_path):
    archive = linked(999)
    (archive / '005' / '000500x.mcap').write_bytes(b'no bag')
    out = tmp_path / 'out'
    assert '1000 bags' in said(started(
        'batch', 'measure', archive, '--out', out, '--cluster', cluster.address))
    rows = list(read_table(out / 'table.parquet'))
    assert [row['bag'] for row in rows] == sorted(row['bag'] for row in rows)
    refused = [Path(row['bag']).name for row in rows if row['refused']]
    assert len(rows) == 1000 and refused == ['000500x.mcap']
    assert len({row['shapes_sha256'] for row in rows if not row['refused']}) == 1


def test_a_hundred_thousand_refused_bags_take_no_more_memory_than_ten_thousand():
    done = subprocess.run(
        [sys.executable, '-m', 'benchmarks.cluster', '--items', '0', '--refused', '100000'],
        capture_output=True, text=True, check=True, cwd=ROOT, timeout=1800)
    few, many = json.loads(done.stdout)['refused']
    assert many['bags'] == 10 * few['bags'] == 100_000
    assert many['driver_peak_mb'] - few['driver_peak_mb'] < 40


def test_a_disk_that_fills_stops_the_work_and_a_larger_one_lets_it_end(linked, tmp_path):
    archive, disk = linked(60), tmp_path / 'disk'
    disk.mkdir()
    mounted = subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=64k', 'tmpfs', disk],
                             capture_output=True, check=False)
    if mounted.returncode:
        pytest.skip('only root can make a small disk')
    try:
        arguments = ['batch', 'measure', archive, '--out', disk / 'out', '--workers', 2]
        with pytest.raises(AssertionError, match='no room to write: .* start again') as stop:
            said(started(*arguments))
        assert 'Traceback' not in str(stop.value)
        assert not (disk / 'out' / 'table.parquet').exists()
        subprocess.run(['mount', '-o', 'remount,size=64m', disk], check=True)
        assert 'of them finished before' in said(started(*arguments))
        assert len(list(read_table(disk / 'out' / 'table.parquet'))) == 60
    finally:
        subprocess.run(['umount', disk], check=True)


def test_evaluation_and_gains_are_the_same_on_a_cluster(cluster, dataset, tmp_path):
    results = []
    for name, where in (('local', []), ('ray', ['--cluster', cluster.address])):
        said(started('evaluate', dataset, '--model', '2d3d-attention', '--views', 3, '--starts', 2,
                     '--seeds', 2, '--threads', 1, '--json', tmp_path / f'{name}.json', *where))
        found = json.loads((tmp_path / f'{name}.json').read_text())
        results.append({key: value for key, value in found.items() if key != 'command'})
        said(started('train-policy', dataset, '--validation', dataset, '--model', 'carving',
                     '--out', tmp_path / name, '--objects', 3, '--candidates', 4, '--starts', 1,
                     '--views', 3, '--epochs', 2, '--threads', 1, *where))
    assert results[0] == results[1]
    assert same_files(tmp_path / 'local' / 'gains-1', tmp_path / 'ray' / 'gains-1')
    assert (tmp_path / 'local' / 'carving-scorer.safetensors').read_bytes() == (
        tmp_path / 'ray' / 'carving-scorer.safetensors').read_bytes()


def test_trainings_and_measurements_of_the_paper_are_the_same_on_a_cluster(
        cluster, dataset, tiny, tmp_path, monkeypatch):
    small_objects(monkeypatch)
    found = []
    for name, crew_or_none in (('local', nullcontext()), ('ray', crew_of(cluster.address))):
        (tmp_path / name).mkdir()
        study = replace(make_study(tmp_path / name, dataset, tiny), policy_seeds=3)
        with crew_or_none as crew:
            for part in ('table5', 'policies'):
                assert run_part(replace(study, crew=crew), part)
        [*trained] = sorted((study.models / 'policies').rglob('weights.safetensors'))
        tables = [column for part in ('table5', 'policies')
                  for table in json.loads((study.out / f'{part}.json').read_text())['tables']
                  for column in table['columns'] if column['heading'] != 'ms to decide']
        found.append((tables, [path.read_bytes() for path in trained]))
    assert len(found[0][1]) == 2 and found[0] == found[1]
