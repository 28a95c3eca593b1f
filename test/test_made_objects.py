"""Objects made while a network learns: those that files would hold, and the same for a step."""

from dataclasses import replace
from functools import partial
from itertools import count
import json
import subprocess
import sys

from active_recon.config import LossConfig
from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.made_ahead import MadeAhead
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.datasets.recipes import Maker, Recipe
from active_recon.datasets.views import read_views
from active_recon.errors import ConfigError, DataError, WorkError
from active_recon.geometry.cameras import AZIMUTHS, pose_azimuths
from active_recon.geometry.canonical import NetworkSpec
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.shapes import CATEGORIES
from active_recon.training import made_objects
from active_recon.training.lifting import train_lifting
from active_recon.training.loop import make_fabric, Run, TrainingConfig
from active_recon.training.made_objects import MadeObjects, Pace
from command_line import command, refusal
from mesh_jobs import a_box, a_death, job, no_mesh
import numpy as np
import pytest
from small_datasets import lamps_and_tables
import torch
from torch.testing import assert_close

SPEC = NetworkSpec(128, 64, needs_front=False)
SHAPES = Recipe({'parametric': 1}, {'any': 1}, views=3, samples=1)
PARTS = ('images', 'seen', 'poses', 'intrinsics', 'voxels')
TINY = LiftingConfig(encoder_channels=(8, 8, 8, 8), pyramid_channels=8, coarse_hidden=8,
                     coarse_channels=4, fine_channels=2, volume_channels=(8, 8, 8),
                     head_channels=4)


def assert_same(one, other):
    for part in PARTS:
        assert_close(torch.as_tensor(np.asarray(getattr(one, part))),
                     torch.as_tensor(np.asarray(getattr(other, part))), rtol=0, atol=0)


def drawn(objects, step):
    """Return all that a step draws from, copied."""
    views = objects.at(step)
    every = torch.arange(len(views))
    across = every[:, None], torch.arange(views.images.shape[1])
    return [folder.name for folder in views.folders], *(part.clone() for part in (
        views.images[across], views.seen[across], views.poses, views.intrinsics,
        views.voxels[every]))


class MadeHere:
    """Makes objects as MadeAhead does, one after the other in this process."""

    def __init__(self, maker, workers, ahead, first, stride):
        self._maker, self._numbers = maker, count(first, stride)

    def take(self):
        return self._maker(next(self._numbers))

    def close(self):
        pass


@pytest.fixture
def no_processes(monkeypatch):
    monkeypatch.setattr(made_objects, 'MadeAhead', MadeHere)


def of_meshes(*jobs):
    return Maker(replace(SHAPES, sources={'mesh': 1}), jobs, SPEC)


# One object


def test_an_object_made_in_memory_is_the_one_that_files_hold(tmp_path):
    made = Maker(SHAPES, (), SPEC)(5)
    jobs = shape_jobs(made.category, [int(made.name.rpartition('-')[2])], tmp_path)
    assert not [outcome.refusal for outcome in make_dataset(
        jobs, 1, fine=True, viewing=Viewing('any', 3, turned=True)) if outcome.refusal]
    read = read_views(list_objects(tmp_path), resolution=64, image_size=128, framed=True)
    assert read.folders[0].name == made.name
    assert_same(made, replace(read, images=read.images[0], seen=read.seen[0], poses=read.poses[0],
                              intrinsics=read.intrinsics[0], voxels=read.voxels[0]))


def test_an_object_depends_on_its_number_and_the_recipe_alone():
    maker = Maker(SHAPES, (), SPEC)
    assert_same(maker(7), Maker(SHAPES, (), SPEC)(7))
    others = {maker(8).name, Maker(replace(SHAPES, seed=1), (), SPEC)(7).name, maker(7).name}
    assert len(others) == 3


def test_objects_are_of_the_seeds_and_the_categories_that_are_trained_on():
    maker = Maker(replace(SHAPES, sources={'parametric': 0.5, 'thing': 0.5}), (), SPEC)
    jobs = [maker.drawn(index, 0)[0] for index in range(300)]
    assert {each.folder.category for each in jobs} == {*CATEGORIES, 'thing'}
    assert all(0 <= int(each.folder.name.rpartition('-')[2]) < 1_000_000 for each in jobs)


def test_sources_and_cameras_are_drawn_by_their_shares():
    maker = Maker(Recipe({'thing': 1, 'mesh': 3}, {'any': 2, 'dome': 8}), (job('box', a_box),),
                  SPEC)
    jobs, viewings, _ = zip(*(maker.drawn(index, 0) for index in range(2000)), strict=True)
    of_meshes, of_dome = (np.mean(each) for each in (
        [each.folder.category == 'part' for each in jobs],
        [each.cameras == 'dome' for each in viewings]))
    assert (of_meshes, of_dome) == (pytest.approx(0.75, abs=0.04), pytest.approx(0.8, abs=0.04))


def test_of_a_turntable_an_object_has_a_part_of_the_cameras_once_each():
    made = Maker(replace(SHAPES, cameras={'turntable': 1}, views=12), (), SPEC)(0)
    steps = pose_azimuths(made.poses) / (AZIMUTHS[1] - AZIMUTHS[0])
    assert_close(torch.as_tensor(steps), torch.as_tensor(steps).round(), rtol=0, atol=1e-4)
    assert len({int(step) % 24 for step in np.rint(steps)}) == 12


def test_a_mesh_is_seen_from_other_places_each_time_and_sometimes_stretched():
    made = [of_meshes(job('box', a_box))(index) for index in range(6)]
    assert len({each.name for each in made}) == len({each.poses.tobytes() for each in made}) == 6
    assert len({each.voxels.sum() for each in made}) > 2


def test_an_object_that_cannot_be_made_is_replaced_by_another():
    maker = of_meshes(job('bad', partial(no_mesh, 'bad.stl')), job('box', a_box))
    made = [maker(index) for index in range(4)]
    assert {each.name.partition('-')[0] for each in made} == {'box'}
    assert {each.left_out for each in made} >= {(), ('part/bad: bad.stl: a mesh without faces',)}


def test_an_object_that_cannot_be_made_is_told_once(no_processes):
    told = []
    maker = of_meshes(job('bad', partial(no_mesh, 'bad.stl')), job('box', a_box))
    with MadeObjects(maker, Pace(8, 0, 8), 1, left_out=told.append) as objects:
        assert len(objects.at(0)) == 8
    assert told == ['part/bad: bad.stl: a mesh without faces']


def test_where_no_object_can_be_made_the_reasons_are_told():
    told = '10 objects in a row cannot be made:\n  part/bad: bad.stl: a mesh without faces$'
    with pytest.raises(DataError, match=told):
        of_meshes(job('bad', partial(no_mesh, 'bad.stl')))(0)


@pytest.mark.parametrize(('values', 'told'), [
    ({'sources': {'chair': 1}}, "for parametric, thing, mesh, got {'chair': 1}"),
    ({'cameras': {'any': -1}}, 'numbers of 0 or more'),
    ({'cameras': {'any': 0}}, 'not all 0'),
    ({'cameras': {'any': float('inf')}}, 'invalid shares'),
    ({'views': 25}, 'expected 1 to 24 views')])
def test_a_recipe_that_makes_nothing_is_refused(values, told):
    with pytest.raises(ConfigError, match=told):
        Recipe(**values)


def test_a_share_of_meshes_without_meshes_is_refused():
    with pytest.raises(ConfigError, match='a share of meshes and no meshes'):
        of_meshes()


def test_what_makes_objects_does_not_need_torch():
    code = ('import sys, active_recon.datasets.made_ahead as made\n'
            'assert made.Maker and "torch" not in sys.modules')
    subprocess.run([sys.executable, '-c', code], check=True)


# A training's objects


@pytest.mark.parametrize('pace', (Pace(3, 0.5, 4), Pace(5, 2.25, 7), Pace(2, 0, 9)))
def test_a_step_draws_from_the_newest_objects_and_none_comes_back(pace):
    numbers = [pace.drawn_at(step) for step in range(40)]
    assert numbers[0] == range(pace.first)
    for step, (one, following) in enumerate(zip(numbers, numbers[1:], strict=False)):
        assert 0 < len(one) <= pace.kept
        assert one.start <= following.start and one.stop <= following.stop
        assert one.stop == pace.first + int(step * pace.per_step)


@pytest.mark.parametrize('numbers', ((0, 1, 4), (2, 1, 0), (2, -1, 4), (2, float('inf'), 4)))
def test_a_pace_that_leaves_nothing_to_draw_is_refused(numbers):
    with pytest.raises(ConfigError, match='Pace: number too small'):
        Pace(*numbers)


@pytest.mark.slow
def test_the_objects_of_a_step_depend_on_nothing_but_its_number(monkeypatch):
    maker, pace = Maker(SHAPES, (), SPEC), Pace(2, 0.5, 3)
    with MadeObjects(maker, pace, 2) as one, MadeObjects(maker, pace, 1) as resumed:
        first = drawn(one, 0)
        monkeypatch.setattr(made_objects, 'MadeAhead', MadeHere)  # the other makes its own
        passed = [drawn(one, step) for step in (2, 3, 6)]
        names, *parts = drawn(resumed, 6)
        assert names == passed[-1][0] and len(names) == 3
        assert_close(parts, list(passed[-1][1:]), rtol=0, atol=0)
        assert first[0] == passed[0][0][:2]
        assert one.made == resumed.made == 5 and one.lacking(6) == 0 and one.lacking(8) == 1
        names, *parts = drawn(one, 3)  # a step that another thread draws later
        assert names == passed[1][0]
        assert_close(parts, list(passed[1][1:]), rtol=0, atol=0)


def test_processes_that_train_together_learn_from_different_objects(no_processes):
    maker, pace = Maker(SHAPES, (), SPEC), Pace(2, 0, 2)
    with MadeObjects(maker, pace, 1, 0, 2) as one, MadeObjects(maker, pace, 1, 1, 2) as other:
        assert drawn(one, 0)[0] == [maker(0).name, maker(2).name]
        assert drawn(other, 0)[0] == [maker(1).name, maker(3).name]
        assert one.fingerprint == other.fingerprint


def test_the_fingerprint_tells_recipes_paces_and_meshes_apart():
    box, pace = job('box', a_box), Pace(2, 0, 2)
    told = {MadeObjects(maker, pace, 1).fingerprint for maker in (
        Maker(SHAPES, (), SPEC), Maker(replace(SHAPES, seed=1), (), SPEC), of_meshes(box),
        of_meshes(box, job('other', a_box)))}
    told.add(MadeObjects(of_meshes(box), Pace(2, 1, 2), 1).fingerprint)
    assert len(told) == 5


def test_a_process_that_dies_ends_the_making_in_a_line_that_says_so():
    ahead = MadeAhead(of_meshes(job('deadly', a_death)), 1, 1)
    with pytest.raises(WorkError, match='a process that makes objects died'):
        ahead.take()
    ahead.close()


@pytest.mark.slow
def test_a_resumed_training_makes_the_same_objects_and_the_same_weights(tmp_path):
    maker, pace = Maker(SHAPES, (), SPEC), Pace(2, 1, 3)
    config = TrainingConfig(4, 2, max_views=2, checkpoint_every=2, bfloat16=False)

    def trained(path, resume=False, until=None):
        torch.manual_seed(0)
        network = Lifting.from_config(TINY)
        with MadeObjects(maker, pace, 1) as objects:
            train_lifting(network, objects, config, LossConfig(1, 0, 'bce+dice'), Run(
                make_fabric(bfloat16=False), path, lambda *told: None, resume, until),
                lambda model: {})
        return network.state_dict()

    whole = trained(tmp_path / 'whole.safetensors')
    trained(tmp_path / 'parts.safetensors', until=2)
    assert_close(trained(tmp_path / 'parts.safetensors', resume=True), whole, rtol=0, atol=0)


# The command


@pytest.fixture(scope='module')
def validation(tmp_path_factory):
    out = tmp_path_factory.mktemp('validation')
    list(make_dataset(shape_jobs('lamp', [1_000_000], out), 1, fine=True,
                      viewing=Viewing('any', 8)))
    return out


def training(validation, out, *more):
    return ('train', '--validation', validation, '--out', out, '--model', 'lifting', '--steps', 2,
            '--batch-size', 2, '--threads', 1, '--make', 1, *more)


@pytest.mark.slow
def test_a_training_on_made_objects_tells_them_in_its_card(
        validation, tmp_path, monkeypatch, capsys):
    meshes = tmp_path / 'meshes' / 'lamp'
    meshes.mkdir(parents=True)
    a_box().export(meshes / 'lamp-1000000.stl')  # as the object of the validation is called
    asked = training(validation, tmp_path / 'run', '--meshes', meshes.parent, '--made-of',
                     'thing=1,mesh=1', '--made-cameras', 'any=1', '--uses', 1)
    assert command(monkeypatch, *asked) == 0
    told, warned = capsys.readouterr()
    assert '1 of 1 validation objects have the names of meshes that are trained on' in warned
    assert 'making the first objects: 16/16' in told and '18 objects made; the steps wai' in told
    data = json.loads((tmp_path / 'run' / 'weights.json').read_text())['data']
    assert (data['made in training'], data['mesh files']) == (18, 1)
    assert data['recipe']['sources'] == {'thing': 1, 'mesh': 1}


@pytest.mark.parametrize(('more', 'told'), [
    (('--made-of', 'thing'), '--made-of: no shares: expected such as any=0.7'),
    (('--made-of', 'chair=1'), 'sources: invalid shares'),
    (('--made-of', 'mesh=1'), 'a share of meshes and no meshes'),
    (('--made-cameras', 'arm=1'), 'cameras: invalid shares'),
    (('--uses', 0), '--uses: expected a number above 0, got 0'),
    (('--meshes', 'any', '--made-of', 'thing=1'), '--meshes: no effect: expected a share of mesh'),
    (('--meshes', 'nowhere'), 'nowhere: no such file or folder')])
def test_options_that_make_nothing_are_refused(
        validation, tmp_path, monkeypatch, capsys, more, told):
    assert told in refusal(monkeypatch, capsys, *training(validation, tmp_path, *more))


def test_folders_and_objects_made_meanwhile_are_one_or_the_other(
        validation, tmp_path, monkeypatch, capsys):
    asked = training(validation, tmp_path)
    assert 'got both' in refusal(monkeypatch, capsys, *asked, validation)
    without = asked[:asked.index('--make')]
    assert 'got neither' in refusal(monkeypatch, capsys, *without)
    assert 'need --make' in refusal(monkeypatch, capsys, *without, '--made-of', 'thing=1',
                                    validation)


def test_a_network_that_needs_a_turntable_does_not_learn_from_made_objects(
        tmp_path, monkeypatch, capsys):
    turntable = lamps_and_tables(tmp_path / 'data', 1)
    asked = training(turntable, tmp_path / 'run', '--model', '2d3d')
    assert 'expected a network that accepts any camera' in refusal(monkeypatch, capsys, *asked)
