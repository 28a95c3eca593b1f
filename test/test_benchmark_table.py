"""The table of doc/benchmarks.md is that of what was measured."""

from argparse import ArgumentParser
from importlib import import_module
import json
from pathlib import Path
import subprocess
import sys

from active_recon.models.weights_files import find_weights, weights_hash
from benchmarks import record
from benchmarks.__main__ import BY_THEMSELVES, PARTS
from benchmarks.figures import Figure
from benchmarks.record import DOCUMENT, keep, part_record, RESULTS, rows, with_table
from benchmarks.stream import counting_lost
import pytest
from shown_commands import LINES, SPANS, words_after
from trimesh.creation import box

ROOT = RESULTS.parents[2]
BENCHMARKS = sorted(path.stem for path in ROOT.glob('benchmarks/*.py')
                    if "__name__ == '__main__'" in path.read_text())


def cells(figure):
    return [cell.strip() for cell in next(rows(part_record([figure], 2.0))).split('|')[1:-1]]


def test_the_document_shows_what_was_measured_last():
    text, parts = DOCUMENT.read_text(), json.loads(RESULTS.read_text())['parts']
    assert with_table(text, parts, BY_THEMSELVES) == text
    assert parts.keys() <= PARTS.keys()
    assert all(figure['name'] in text for part in parts.values() for figure in part['figures'])


@pytest.mark.parametrize(('samples', 'goal', 'more', 'words'), [
    ([3.0], 4, False, 'at most 4 ms'), ([5.0], 4, False, 'at most 4 ms: missed'),
    ([5.0], 4, True, 'at least 4 ms'), ([3.0], 4, True, 'at least 4 ms: missed'),
    ([3.0], None, False, '')])
def test_a_goal_that_is_not_reached_is_called_missed(samples, goal, more, words):
    assert cells(Figure('a view', 'ms', samples, goal, more_is_better=more))[3] == words


def test_times_are_told_as_multiples_of_the_reference_and_nothing_else_is():
    assert cells(Figure('a view', 'ms', [5.0], None))[4] == '2.5'
    assert cells(Figure('a start', 's', [5.0], None))[4] == '2500.0'
    assert cells(Figure('memory', 'MB', [5.0], None))[4] == ''


def test_images_that_were_lost_are_among_the_slowest():
    some = Figure('p99', 'ms', counting_lost([0.01] * 147 + [0.0] * 3), 60, percentile=99)
    assert some.value == 1000 and not some.reached


@pytest.mark.parametrize('name', BENCHMARKS)
def test_every_benchmark_explains_itself(name, monkeypatch, capsys):
    benchmark = import_module(f'benchmarks.{name}')
    monkeypatch.setattr(sys, 'argv', [name, '--help'])
    with pytest.raises(SystemExit) as ended:
        benchmark.main()
    assert not ended.value.code
    assert 'usage: ' in capsys.readouterr().out


def test_a_page_names_parts_that_exist():
    for words in words_after('python -m benchmarks', [*LINES, *SPANS]):
        assert PARTS.keys() >= set(words)


@pytest.mark.parametrize('name', BENCHMARKS)
def test_a_benchmark_is_shown_with_options_that_it_accepts(name, monkeypatch):
    class Accepted(Exception):  # noqa: N818
        """All options were read, and nothing is measured."""

    def parse(parser):
        read(parser)
        raise Accepted

    read = ArgumentParser.parse_args
    monkeypatch.setattr(ArgumentParser, 'parse_args', parse)
    benchmark = import_module(f'benchmarks.{name}')
    own = (benchmark.__doc__ or '').replace('\\\n', '').splitlines()
    for words in words_after(rf'(?:PYTHONPATH=test )?python -m benchmarks\.{name}',
                             [*LINES, *SPANS, *own]):
        monkeypatch.setattr(sys, 'argv', [name, *words])
        with pytest.raises(Accepted):
            benchmark.main()


@pytest.mark.parametrize('name', ['lifting', 'views'])
def test_studies_without_their_folder_are_refused_in_one_line(name, monkeypatch):
    benchmark = import_module(f'benchmarks.{name}')
    monkeypatch.setattr(sys, 'argv', [name, str(Path('no', 'folder'))])
    with pytest.raises(SystemExit, match='no such folder: expected that of the data'):
        benchmark.main()


def test_what_depth_adds_is_not_measured_where_there_is_none(
        dataset, tmp_path, monkeypatch, capsys):
    out = tmp_path / 'depth.json'
    monkeypatch.setattr(sys, 'argv', ['depth', str(dataset), '--out', str(out)])
    with pytest.raises(SystemExit):
        import_module('benchmarks.depth').main()
    assert 'no depth images: expected a dataset made with --depth' in capsys.readouterr().err
    assert not out.exists()


def test_the_meshes_of_the_default_network_are_measured_under_the_hash_of_its_weights(
        dataset, tmp_path, monkeypatch):
    benchmark = import_module('benchmarks.watertight')
    monkeypatch.setattr(benchmark.Reconstructor, 'load', lambda weights, threads: None)
    said = benchmark._said(box((1, 1, 1)))
    monkeypatch.setattr(benchmark, '_of_object', lambda folder, _, seen: iter([
        ('true cells', {'object': folder.name, 'true_bodies': 1, **said})]))
    out = tmp_path / 'watertight.json'
    monkeypatch.setattr(sys, 'argv', ['watertight', str(dataset), '--out', str(out)])
    benchmark.main()
    written = json.loads(out.read_text())
    assert written['weights_sha256'] == weights_hash(find_weights(None))
    assert written['counts']['true cells']['all three'] > 0


@pytest.mark.parametrize('name', ['meshes', 'mesh_colors'])
def test_a_split_without_models_is_refused_in_one_line(name, tmp_path, monkeypatch):
    manifest, out = tmp_path / 'models.csv', tmp_path / 'out.json'
    manifest.write_text('category,file,split,source,licence,licence_evidence,front_axis,sha256\n')
    monkeypatch.setattr(sys, 'argv', [name, str(manifest), '--out', str(out)])
    with pytest.raises(SystemExit, match="no model of the split 'val': expected one or more"):
        import_module(f'benchmarks.{name}').main()
    assert not out.exists()


def test_what_another_machine_measured_is_told_where_it_stays_in_the_table(tmp_path, monkeypatch):
    files = {name: tmp_path / name for name in ('RESULTS', 'DOCUMENT')}
    for name, file in files.items():
        monkeypatch.setattr(record, name, file)
    files['DOCUMENT'].write_text('<!-- bench: begin -->\n<!-- bench: end -->\n')
    files['RESULTS'].write_text(json.dumps({'parts': {}}))
    own = part_record([Figure('a view', 'ms', [3.0], 4)], 2.0)
    elsewhere = {**own, 'machine': 'another'}
    before = {key: value for key, value in own.items() if key != 'machine'}
    order = ['here', 'elsewhere', 'before']
    assert keep({'elsewhere': elsewhere, 'before': before}, order, []) == ['elsewhere', 'before']
    assert keep({'here': own, 'before': own}, order, []) == ['elsewhere']
    assert files['DOCUMENT'].read_text().count('| a view |') == 3


@pytest.mark.parametrize('name', ['meshes', pytest.param('watertight', marks=pytest.mark.slow),
                                  pytest.param('depth', marks=pytest.mark.slow)])
def test_a_benchmark_of_data_that_are_not_there_ends_in_one_line(name, tmp_path):
    ended = subprocess.run([sys.executable, '-m', f'benchmarks.{name}', tmp_path / 'none.csv'],
                           cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith(f'{tmp_path}/none.csv: no ')
    assert ended.stderr.count('\n') == 1
