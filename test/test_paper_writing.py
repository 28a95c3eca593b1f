"""Results on disk: tables that keep the published apart, three files, and where they came from."""

from dataclasses import replace
import json
from pathlib import Path

from active_recon.errors import ConfigError, DataError
from active_recon.evaluation.statistics import Interval
from active_recon.models.weights_files import find_weights, PAPER_MODEL
from active_recon.paper.claims import FAILS, HOLDS
from active_recon.paper.document import write_document
from active_recon.paper.results import Claim, Column, PUBLISHED, Result, Table
from active_recon.paper.study import Objects, Study
from active_recon.paper.writing import is_current, provenance, read_result, write_result
from active_recon.reporting import silent
from command_line import command
import numpy as np
from PIL import Image
import pytest
import torch

OWN = Column('IoU', [Interval(0.5, 0.4, 0.6), None, 0.25])
THEIRS = Column('PTN', [0.3, None, 0.4], published=True)
TABLE = Table('IoU by category', 'category', ['car', 'lamp', 'sofa'], [OWN, THEIRS])
INPUTS = {'data': {'test': {'folder': 'data/test', 'objects': 6, 'sha256': 'ab' * 32}},
          'seed': 0, 'weights': {'ours': {'sha256': 'cd' * 32, 'threshold': 0.4}}}


@pytest.fixture
def study(tmp_path):
    return Study(out=tmp_path / 'results', seed=3)


def result(title='A table', claims=()):
    return Result(title, 'What was measured.', [TABLE], claims,
                  np.full((40, 60, 3), 200, np.uint8), {'iou': [0.5]})


def test_a_table_in_markdown_tells_means_with_their_intervals():
    assert TABLE.markdown().splitlines() == [
        '| category | IoU | published, ShapeNet: PTN |', '| --- | ---: | ---: |',
        '| car | 0.500 [0.400, 0.600] | 0.300 |', '| lamp | – | – |', '| sofa | 0.250 | 0.400 |']


def test_published_figures_and_measured_ones_never_share_a_column():
    with pytest.raises(ConfigError, match='columns of their own'):
        Column('PTN', [Interval(0.5, 0.4, 0.6)], published=True)
    with pytest.raises(ConfigError, match='columns of their own'):
        Column(f'{PUBLISHED}: PTN', [Interval(0.5, 0.4, 0.6)])


def test_columns_of_another_length_are_refused():
    with pytest.raises(ConfigError, match="wrong number of cells: expected 3 in the column 'PTN', "
                       'got 1'):
        Table('IoU', 'category', ['car', 'lamp', 'sofa'], [Column('PTN', [0.3], published=True)])


def test_a_result_is_three_files_that_say_where_they_come_from(study):
    write_result(study, 'table9', INPUTS, result())
    assert {path.name for path in study.out.iterdir()} == {
        'table9.json', 'table9.md', 'table9.png'}
    found = read_result(study, 'table9')
    assert found['command'] == f'active-recon paper table9 --out {study.out} --seed 3'
    assert found['inputs'] == INPUTS
    assert found['tables'][0]['columns'][1] == {
        'heading': 'published, ShapeNet: PTN', 'published': True, 'cells': [0.3, None, 0.4]}
    told = (study.out / 'table9.md').read_text()
    assert told.startswith('# A table\n\nWhat was measured.\n\n![A table](table9.png)\n')
    for words in (found['command'], 'objects 6', '`abababababab`', 'sha256 `cdcdcdcdcdcd`',
                  'seed: 0', 'threshold 0.4'):
        assert words in told


def test_a_result_is_current_as_long_as_its_inputs_and_its_files_are_the_same(study):
    assert not is_current(study, 'table9', INPUTS)
    write_result(study, 'table9', INPUTS, result())
    assert is_current(study, 'table9', INPUTS)
    assert not is_current(study, 'table9', INPUTS | {'seed': 1})
    (study.out / 'table9.png').unlink()
    assert not is_current(study, 'table9', INPUTS)


def test_a_result_that_is_no_json_is_made_again_and_cannot_be_read(study):
    write_result(study, 'table9', INPUTS, result())
    (study.out / 'table9.json').write_text('{')
    assert not is_current(study, 'table9', INPUTS)
    with pytest.raises(DataError, match='`active-recon paper table9`'):
        read_result(study, 'table9')


def test_a_result_whose_writing_is_interrupted_leaves_the_files_of_the_one_before(
        study, monkeypatch):
    def interrupted(picture, path, *given, **more):
        Path(path).write_bytes(b'half of it')
        raise KeyboardInterrupt

    write_result(study, 'table9', INPUTS, result())
    before = {path: path.read_bytes() for path in study.out.iterdir()}
    monkeypatch.setattr(Image.Image, 'save', interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_result(study, 'table9', INPUTS, result('Another table'))
    assert {path: path.read_bytes() for path in study.out.iterdir()} == before


def test_the_same_result_is_the_same_files(study, tmp_path):
    again = replace(study, out=tmp_path / 'again')
    write_result(study, 'table9', INPUTS, result())
    write_result(again, 'table9', INPUTS, result())
    for path in study.out.iterdir():
        other = (again.out / path.name).read_bytes()
        assert path.read_bytes() == other.replace(str(again.out).encode(),
                                                  str(study.out).encode())


def test_a_command_names_what_is_not_usual():
    assert Study().command('table1') == 'active-recon paper table1'
    assert Study(data=Path('my data')).command('fig5') == (
        "active-recon paper fig5 --data 'my data'")
    told = Study(training=('train', 'real_train'), samples=10, model='2d3d').command('all')
    assert told == ('active-recon paper all --model 2d3d --samples 10 --training train '
                    '--training real_train')


def test_the_document_puts_together_what_is_there_and_tells_what_holds(study):
    claims = [Claim('A is ahead', HOLDS, 'By 0.1.'), Claim('B rises', FAILS, 'It falls.')]
    write_result(study, 'table5', INPUTS, result('Table 5', claims))
    write_result(study, 'table1', INPUTS, result('Table 1'))
    assert write_document(study)
    told = (study.out / 'README.md').read_text()
    assert told.index('## Table 1') < told.index('## Table 5')
    assert told.index('### What does not hold here') < told.index('### What holds here')
    assert '- A is ahead ([table5](table5.md)): **holds here**. By 0.1.' in told
    assert '### What is left open here' not in told
    assert f'`{study.command("table3")}`' in told.partition('## Not measured yet')[2]
    assert not write_document(study)


def test_there_is_no_document_of_nothing(study):
    with pytest.raises(DataError, match='active-recon paper all'):
        write_document(study)


def test_a_result_that_cannot_be_read_is_not_told_as_not_measured_yet(study):
    for name in ('table1', 'table5'):
        write_result(study, name, INPUTS, result(name))
    (study.out / 'table5.json').write_text('{"title": ')
    with pytest.raises(DataError, match='table5.json: no readable result'):
        write_document(study)


def test_objects_are_known_by_their_names_and_voxels(dataset, tmp_path):
    every, lamps = Objects(dataset), Objects(dataset, 'lamp')
    assert every.identity()['objects'] == 6
    assert lamps.identity()['objects'] == 3
    assert every.identity() == Objects(dataset).identity()
    assert every.identity()['sha256'] != lamps.identity()['sha256']
    assert every.present
    assert not Objects(dataset, resolution=64).present
    assert not Objects(tmp_path / 'nothing').present
    with pytest.raises(DataError, match='category sofa'):
        Objects(dataset, 'sofa').folders()


def test_silence_takes_every_step():
    with silent('title', 3) as advance:
        advance(1, 'note')


def test_results_are_ready_for_json(study):
    write_result(study, 'table9', INPUTS, result())
    assert json.loads((study.out / 'table9.json').read_text())['figures'] == {'iou': [0.5]}


def test_weights_that_ship_are_named_without_the_folder_they_happen_to_lie_in(study):
    told = provenance(study, {}, {'ours': find_weights(PAPER_MODEL)})['weights']['ours']
    assert told['file'] == '2d3d-attention.safetensors, which ships'


def test_the_command_that_is_stopped_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr('active_recon.paper.parts.run_part', stopped)
    assert command(monkeypatch, 'paper', 'table1', '--models', tmp_path, '--out', tmp_path,
                   '--threads', torch.get_num_threads()) == 130
    assert 'to continue run it again, without --again' in capsys.readouterr().out
