"""`active-recon policies`, from the command line to the files that it writes."""

import errno
from importlib import import_module
import json
from pathlib import Path
from shutil import copytree

from active_recon.cli.main import main
from active_recon.datasets.layout import list_objects
import pytest
import torch


@pytest.fixture(autouse=True)
def as_many_threads_as_before():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def command(monkeypatch, *arguments):
    """Run `active-recon policies`; return its exit code."""
    monkeypatch.setattr('sys.argv', ['active-recon', 'policies', *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0


def test_policies_are_measured_set_by_set_and_told_in_a_table(dataset, tmp_path, monkeypatch):
    assert command(monkeypatch, dataset, '--model', 'carving', '--policies',
                   'random,sequence,oracle', '--training', dataset, '--training-objects', 2,
                   '--objects', 2, '--starts', 1, '--views', 2, '--threads', 1, '--out',
                   tmp_path) == 0
    result = json.loads((tmp_path / 'policies.json').read_text())
    [figures] = result['sets']
    assert list(figures['policies']) == ['random', 'sequence', 'oracle']
    assert (figures['objects'], figures['views'], figures['side']) == (2, 24, 32)
    assert len(result['sequence']['offsets_deg']) == 1 and result['sequence']['objects'] == 2
    assert {'same', 'repeatable'} == set(figures['gap'])
    text = (tmp_path / 'policies.md').read_text()
    assert '| oracle |' in text and 'the repeatable gap' in text


@pytest.mark.slow
def test_a_sequence_whose_motion_costs_is_found_on_the_training_objects(
        dataset, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, dataset, '--model', 'carving', '--policies', 'sequence@1e-6',
                   '--training', dataset, '--training-objects', 2, '--objects', 2, '--starts', 1,
                   '--views', 2, '--threads', 1, '--out', tmp_path) == 0
    result = json.loads((tmp_path / 'policies.json').read_text())
    assert list(result['sets'][0]['policies']) == ['sequence@1e-6']
    assert 'warning: --training is measured, too' in capsys.readouterr().err
    assert len(result['sequence']['offsets_deg']) == 1


@pytest.mark.parametrize(('arguments', 'said'), [
    (['--policies', 'random,best'], "got 'best'"),
    (['--policies', ','], 'policies: none: expected some of'),
    (['--policies', 'random@'], 'no cost of motion: expected NAME@COST'),
    (['--policies', 'random@-1'], "got 'random@-1'"),
    (['--policies', 'random@nan'], "got 'random@nan'"),
    (['--policies', 'sequence'], 'no training objects: expected --training'),
    (['--policies', 'sequence@0.1'], 'no training objects: expected --training'),
    (['--policies', 'random', '--training', 'none', '--training-objects', 2],
     '--training, --training-objects without sequence among --policies'),
    (['--training-objects', 2], '--training-objects without sequence among --policies'),
    (['--model', 'carving,lifting'], 'several networks: expected one'),
    (['--category', 'ship'], 'no such objects'),
])
def test_what_cannot_be_measured_is_refused_in_one_line(
        arguments, said, dataset, tmp_path, monkeypatch, capsys):
    capsys.readouterr()
    assert command(monkeypatch, dataset, '--model', 'carving', '--views', 2, '--objects', 2,
                   *arguments, '--threads', 1, '--out', tmp_path) == 2
    line = [line for line in capsys.readouterr().err.splitlines() if 'active-recon: ' in line]
    assert len(line) == 1 and said in line[0]


def test_a_learned_policy_that_weights_lack_is_told_before_a_sequence_is_sought(
        dataset, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, dataset, '--model', 'carving', '--views', 2, '--policies',
                   'sequence,swapped', '--training', dataset, '--threads', 1,
                   '--out', tmp_path) == 2
    said = capsys.readouterr()
    assert 'no view policy' in said.err and 'finding a sequence' not in said.out


def test_a_lone_object_is_not_swapped_for_itself(dataset, tmp_path, monkeypatch, capsys):
    first = list_objects(dataset)[0]
    for part in (first.images_folder, first.voxels_path().parent):
        copytree(part, tmp_path / 'one' / part.relative_to(dataset))
    capsys.readouterr()
    assert command(monkeypatch, dataset, tmp_path / 'one', '--policies', 'random,swapped',
                   '--threads', 1, '--out', tmp_path) == 2
    told = capsys.readouterr()
    assert 'no other object to show: expected two or more' in told.err
    assert 'choosing views' not in told.out + told.err  # of the other folder, for hours


@pytest.mark.parametrize('name', ['policies', 'study'])
def test_what_was_measured_stays_where_the_disk_is_full_later(name, tmp_path, monkeypatch):
    write = import_module(f'active_recon.cli.{name}')._write
    result = {'command': 'a command', 'sets': []}
    write(result, tmp_path)
    before = (tmp_path / f'{name}.json').read_text()
    whole = Path.write_text

    def full(path, text):
        whole(path, text[:5])
        raise OSError(errno.ENOSPC, 'no space left')

    monkeypatch.setattr(Path, 'write_text', full)
    with pytest.raises(OSError, match='no space left'):
        write({**result, 'model': 'carving'}, tmp_path)
    assert (tmp_path / f'{name}.json').read_text() == before
