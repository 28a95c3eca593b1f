"""Archives in an object store: the rows are those of paths; what is not reached is told."""

from importlib import import_module
from pathlib import Path
import shutil
import subprocess
import sys

from active_recon.batch.finding import place_of
from active_recon.batch.table import read_table
from active_recon.cluster import stores
from active_recon.cluster.stores import at_hand, Stored
from active_recon.errors import ConfigError, DataError
from command_line import refusal
import fsspec
import pytest
from ray_clusters import free_port, ray_cluster, ROOT, wait_for_port

PAPER = ROOT / 'bags' / 'golden' / 'paper'


def test_what_is_no_shared_storage_is_refused(monkeypatch, capsys, tmp_path):
    for url, reason in (('memory://day', 'the memory of one process'),
                        ('https://example.com/day', 'no such storage'),
                        ('s3:/fleet/day', 'no such storage')):
        said = refusal(monkeypatch, capsys, 'batch', 'measure', url, '--out', tmp_path)
        assert reason in said
        assert 'expected a path or file:///PATH that all machines see, or s3://BUCKET' in said
    assert 's3:/fleet/out: no such storage' in refusal(
        monkeypatch, capsys, 'batch', 'measure', PAPER, '--out', 's3:/fleet/out')
    said = refusal(monkeypatch, capsys, 'batch', 'measure', PAPER, '--out', tmp_path, '--truth',
                   'ftp://fleet/truth')
    assert 'no such storage' in said
    for command in (['render', 's3://fleet/meshes', tmp_path], ['dataset', 'build', 's3://fleet']):
        assert 'no path: expected a folder that all machines see' in refusal(
            monkeypatch, capsys, *command)


def test_a_url_is_the_same_whatever_the_case_of_its_scheme(monkeypatch):
    monkeypatch.setattr(Stored, 'require_package', lambda self: None)
    assert place_of('S3://Fleet/Day/') == Stored('s3://Fleet/Day')
    assert place_of('FILE:///fleet/Day') == place_of('file:/fleet/Day') == Path('/fleet/Day')


def test_without_its_package_a_store_is_refused_with_what_to_install(monkeypatch):
    stores._file_system.cache_clear()
    monkeypatch.setitem(sys.modules, 's3fs', None)
    monkeypatch.delitem(import_module('fsspec.registry')._registry, 's3', raising=False)
    with pytest.raises(ConfigError, match=r'no s3fs on .*: expected .* pip install s3fs'):
        place_of('s3://fleet/day')


def test_errors_name_the_place_in_the_store_and_not_its_copy(monkeypatch):
    place = Stored('s3://fleet/day/a.mcap')
    assert place.parents == [Stored('s3://fleet/day'), Stored('s3://fleet')]
    monkeypatch.setattr(Stored, 'fetch', lambda self, folder: folder / self.name)
    with pytest.raises(DataError, match='^s3://fleet/day/a.mcap: no bag$') as raised, at_hand(
            place) as copy:
        raise DataError(f'{copy}: no bag', 'poisonous')
    assert raised.value.kind == 'poisonous'
    assert not copy.parent.exists()


@pytest.fixture
def s3(monkeypatch):
    """Return a file system of an S3 server on the loopback, and the server."""
    port = free_port()
    for name, value in (('AWS_ENDPOINT_URL', f'http://127.0.0.1:{port}'),
                        ('AWS_ACCESS_KEY_ID', 'a'), ('AWS_SECRET_ACCESS_KEY', 'b'),
                        ('AWS_DEFAULT_REGION', 'us-east-1')):
        monkeypatch.setenv(name, value)
    server = subprocess.Popen([sys.executable, '-m', 'moto.server', '-H', '127.0.0.1', '-p',
                               str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_for_port('127.0.0.1', port)
        files = fsspec.filesystem('s3', use_listings_cache=False, skip_instance_cache=True)
        files.mkdir('fleet')
        yield files, server
    finally:
        server.kill()
        server.wait()


def batch(archive, out, *where):
    """Run the command in a process of its own; return its exit code and what it said."""
    done = subprocess.run(
        [sys.executable, '-P', '-m', 'active_recon.cli.main', 'batch', 'measure', str(archive),
         '--out', str(out), *map(str, where)],
        capture_output=True, text=True, cwd=ROOT, timeout=600, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
def test_an_archive_in_s3_gives_the_rows_of_one_on_a_disk_here_and_on_a_cluster(s3, tmp_path):
    files, server = s3
    for name in ('a', 'b/c'):
        shutil.copytree(PAPER, tmp_path / 'archive' / name)
    (tmp_path / 'archive' / 'x.mcap').write_bytes(b'no bag')
    files.put(str(tmp_path / 'archive'), 'fleet/archive', recursive=True)
    assert batch(tmp_path / 'archive', tmp_path / 'disk', '--workers', 1)[0] == 0
    with ray_cluster() as cluster:  # its processes have the environment of the server
        for name, where in (('here', ['--workers', 1]), ('ray', ['--cluster', cluster.address])):
            code, said = batch('s3://fleet/archive', f's3://fleet/{name}', *where)
            assert code == 0 and '3 bags' in said, said

    def written(name):
        return {path.removeprefix(f'fleet/{name}/'): files.cat_file(path)
                for path in files.find(f'fleet/{name}')}

    assert written('here') == written('ray')
    assert {'table.parquet', 'summary.html'} < written('ray').keys()
    assert len(written('ray')) == 2 + 3  # and a result for each bag: nothing else is left
    files.get_file('fleet/ray/table.parquet', str(tmp_path / 'table.parquet'))

    def renamed(row):
        there = {key: row[key].replace(str(tmp_path / 'archive'), 's3://fleet/archive')
                 for key in ('bag', 'refused')}
        return row | there

    assert list(read_table(tmp_path / 'table.parquet')) == [
        renamed(row) for row in read_table(tmp_path / 'disk' / 'table.parquet')]
    files.pipe_file('fleet/archive/x.mcap', b'another')
    assert '2 of them finished before' in batch(
        's3://fleet/archive/**/*', 's3://fleet/here', '--workers', 1)[1]
    server.kill()
    server.wait()
    code, said = batch(tmp_path / 'archive' / 'a', 's3://fleet/here', '--workers', 1)
    assert code == 2 and 's3://fleet/here/' in said and 'cannot be reached from' in said
    assert 'Traceback' not in said


@pytest.mark.slow
def test_a_machine_without_the_store_says_so(s3, tmp_path, monkeypatch):
    files, _ = s3
    files.put(str(PAPER), 'fleet/archive/a', recursive=True)
    with monkeypatch.context() as patch:
        patch.setenv('AWS_ENDPOINT_URL', 'http://127.0.0.1:9')  # that of the cluster's machines
        with ray_cluster(workers=1) as cluster:
            patch.undo()
            code, said = batch('s3://fleet/archive', 's3://fleet/out', '--cluster',
                               cluster.address)
    assert code == 2 and 'cannot be reached from' in said and 'Traceback' not in said
