"""Every part of the paper: three files, where they came from, and no work done twice."""

from dataclasses import replace
import json

from active_recon.errors import ConfigError
from active_recon.paper import examples, timing
from active_recon.paper.document import write_document
from active_recon.paper.parts import PARTS, run_part
from active_recon.paper.results import PUBLISHED
from command_line import command
from paper_study import make_study, small_objects
from PIL import Image
import pytest
from shown_views import part_of
import torch

pytestmark = pytest.mark.slow  # all parts are made: half a minute of a core

@pytest.fixture(scope='module')
def patch():
    with pytest.MonkeyPatch.context() as patch:
        small_objects(patch)
        patch.setattr(timing, 'RUNS', 1)
        yield patch


@pytest.fixture(scope='module')
def study(dataset, tiny, tmp_path_factory, patch):
    """Return a study whose parts are all made, once."""
    made = make_study(tmp_path_factory.mktemp('study'), dataset, tiny)
    for name in PARTS:
        run_part(made, name)
    return made


def read(study, name):
    return json.loads((study.out / f'{name}.json').read_text())


@pytest.mark.parametrize('name', PARTS)
def test_a_part_writes_markdown_json_and_a_picture(study, name):
    found = read(study, name)
    assert found['command'].startswith(f'active-recon paper {name} --data ')
    assert (study.out / f'{name}.md').read_text().startswith(f'# {found["title"]}\n')
    with Image.open(study.out / f'{name}.png') as picture:
        assert min(picture.size) > 100
        assert len(picture.convert('RGB').getcolors(1 << 24)) > 20  # something is drawn


@pytest.mark.parametrize('name', PARTS)
def test_a_part_names_its_data_seed_and_weights(study, name):
    inputs = read(study, name)['inputs']
    assert inputs['seed'] == 0
    assert inputs['generators'] == 'ab' * 32
    assert inputs['data']
    assert inputs['weights']
    for origin in (*inputs['data'].values(), *inputs['weights'].values()):
        assert len(origin['sha256']) == 64
    assert all(0 < origin['threshold'] < 1 for origin in inputs['weights'].values())


@pytest.mark.parametrize('name', PARTS)
def test_published_figures_stand_in_columns_of_their_own(study, name):
    for table in read(study, name)['tables']:
        for column in table['columns']:
            assert column['heading'].startswith(PUBLISHED) == column['published']
            measured = [cell for cell in column['cells'] if isinstance(cell, dict)]
            assert not (measured and column['published'])


def test_every_table_has_the_papers_own_figures_beside_ours(study):
    for name in ('table1', 'table2', 'table3', 'table4', 'table5'):
        columns = read(study, name)['tables'][0]['columns']
        assert {column['published'] for column in columns} == {True, False}
        dataset = 'PASCAL3D+' if name in ('table2', 'table5') else 'ShapeNet'
        assert all(column['heading'].startswith(f'{PUBLISHED}, {dataset}: ')
                   for column in columns if column['published'])


def test_a_second_run_does_no_work_and_changes_nothing(study, monkeypatch):
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns)
              for path in study.out.iterdir()}
    monkeypatch.setattr('active_recon.paper.parts.write_result', None)
    assert not any(run_part(study, name) for name in PARTS)
    assert before == {path: (path.read_bytes(), path.stat().st_mtime_ns)
                      for path in study.out.iterdir()}


def test_a_part_that_is_asked_for_again_finds_the_same(study):
    before = read(study, 'table5')
    assert run_part(study, 'table5', again=True)
    assert read(study, 'table5') == before


def test_table_1_starts_alike_whoever_chooses(study):
    figures = read(study, 'table1')['figures']
    for scheme in ('two-stage', 'joint'):
        first = [figures[key][f'{scheme}, {way}'][0]
                 for key in ('loss', 'iou') for way in ('random views', "attention's choice")]
        assert first[0] == first[1]
        assert first[2] == first[3]


def test_figure_5_follows_table_1(study):
    assert read(study, 'fig5')['inputs']['weights'] == read(study, 'table1')['inputs']['weights']


def test_table_3_measures_the_octree_beside_a_dense_decoder(study):
    octree = read(study, 'table3')['tables'][-1]
    cells, dense = (column['cells'] for column in octree['columns'][:2])
    assert octree['rows'] == ['8', '16', '32', 'all levels']
    assert dense == [512, 4096, 32768, 37376]
    assert all(own <= full for own, full in zip(cells, dense, strict=True))


def test_the_nearest_image_of_the_training_set_itself_is_its_own(study):
    columns = {column['heading']: column['cells']
               for column in read(study, 'table3')['tables'][0]['columns']}
    assert {cell['mean'] for cell in columns['nearest training image']} == {1.0}


def test_the_steps_of_a_reconstruction_sum_to_its_time(study):
    seconds, percent = (column['cells'] for column in read(study, 'table4')['tables'][0][
        'columns'][:2])
    total = seconds.pop()['mean']
    assert sum(step['mean'] for step in seconds) == pytest.approx(total)
    assert sum(float(share) for share in percent[:-1]) == pytest.approx(100, abs=0.3)


def test_times_tell_in_words_of_how_many_threads_they_are(study):
    assert 'on 1 CPU thread (' in (study.out / 'table4.md').read_text()
    assert 'on 1 CPU thread, the mean' in (study.out / 'fig10.md').read_text()


def test_figure_7_shows_photographs_where_pascal3d_is_given(study, tmp_path, monkeypatch):
    views = study.read(study.objects('test'))
    photographs = replace(part_of(views, chosen=slice(1)), unreadable=('one',))
    (tmp_path / 'Annotations' / 'sofa_pascal').mkdir(parents=True)
    (tmp_path / 'Annotations' / 'sofa_pascal' / '1.mat').write_bytes(b'12')
    monkeypatch.setattr(examples, 'list_photographs', lambda root: ([], []))
    monkeypatch.setattr(examples, 'read_photographs', lambda *told: photographs)
    real = replace(study, pascal3d=tmp_path, out=tmp_path / 'results')
    assert run_part(real, 'fig7')
    assert 'Photographs of PASCAL3D+ (6; 1 left out)' in (real.out / 'fig7.md').read_text()
    assert read(real, 'fig7')['inputs']['pascal3d']['images'] == 1
    assert 'these are renders of real CC0 models' in (study.out / 'fig7.md').read_text()


def test_an_unknown_part_is_refused(study):
    with pytest.raises(ConfigError, match=r"no such part: expected one of table1, .*got 'table6'"):
        run_part(study, 'table6')


def paper(monkeypatch, study, *arguments):
    """Run `active-recon paper` with the study's settings; return its exit code."""
    before = torch.get_num_threads()
    code = command(monkeypatch, 'paper', '--data', study.data, '--models', study.models, '--out',
                   study.out, '--model', study.model, '--samples', 96, '--starts', 2, '--threads',
                   1, *arguments)
    torch.set_num_threads(before)
    return code


def test_the_command_makes_parts_systems_and_the_document(study, monkeypatch, capsys):
    write_document(study)
    assert paper(monkeypatch, study, 'systems', 'document') == 0
    told = capsys.readouterr().out
    assert f'3D-R2N2: {study.models / "r2n2" / "weights.safetensors"}' in told
    assert 'README.md: unchanged' in told


def test_the_command_refuses_parts_that_there_are_not(study, monkeypatch, capsys):
    assert paper(monkeypatch, study, 'table6') == 2
    assert 'expected some of table1,' in capsys.readouterr().err
    assert paper(monkeypatch, study, 'table1', '--device', 'tpu') == 2
    assert '--device: no such device: expected cpu, or cuda' in capsys.readouterr().err


def test_what_only_a_later_part_needs_is_refused_before_an_earlier_one_is_made(
        study, tmp_path, monkeypatch, capsys):
    for option, reason in (('--model', "expected weights of the paper's network"),
                           ('--pascal3d', 'not the PASCAL3D+ dataset')):
        assert paper(monkeypatch, study, 'systems', 'fig7', 'table4', option,
                     tmp_path / 'missing') == 2
        out, told = capsys.readouterr()
        assert reason in told and not out


def test_the_document_tells_every_part(study):
    write_document(study)
    told = (study.out / 'README.md').read_text()
    assert all(read(study, name)['title'] in told for name in PARTS)
    assert 'Not measured yet' not in told
