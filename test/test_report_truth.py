"""The true shape beside a run, and the shape where a bag holds none."""

from dataclasses import replace
import math
from pathlib import Path

from active_recon.bags.run import RecordedRun
from active_recon.errors import ConfigError, MeshError
from active_recon.objects import find_object
from active_recon.reconstructor import Reconstructor
from active_recon.report.subject import Subject
from active_recon.report.truth import (
    known_truth,
    lacks_reconstruction,
    read_truth,
    with_reconstruction,
)
from active_recon.voxels import VoxelGrid, write_binvox
import numpy as np
import pytest
from report_runs import changed, recorded_run


@pytest.fixture(scope='module')
def run() -> RecordedRun:
    return recorded_run('chair', 'uniform', 3)


def shown(run, mesh, up=''):
    return replace(run, parameters={'turntable_camera': {'mesh': mesh, 'up': up}})


def test_object_that_ships_is_known_wherever_it_was_installed(run):
    truth = known_truth(shown(run, '/elsewhere/active_recon/objects/chair.glb'))
    assert (truth == read_truth(find_object('chair'), run)).all()


@pytest.mark.parametrize(('mesh', 'up'), [
    ('', ''), ('/mine/chair.glb', ''), ('/elsewhere/active_recon/objects/teapot.glb', ''),
    ('/elsewhere/active_recon/objects/chair.glb', 'z')])
def test_truth_of_any_other_object_is_not_known(run, mesh, up):
    assert known_truth(shown(run, mesh, up)) is None


def test_mesh_and_its_binvox_are_the_same_truth(run, tmp_path):
    cells = read_truth(find_object('chair'), run)
    assert (read_truth(Path('chair'), run) == cells).all()
    write_binvox(VoxelGrid(cells.astype(np.float32)), tmp_path / 'chair.binvox')
    assert (read_truth(tmp_path / 'chair.binvox', run) == cells).all()


def test_truth_turns_with_the_front_of_the_object(run):
    turned = replace(run, parameters={'reconstructor': {'object_yaw': math.pi / 2}})
    plain, quarter = (read_truth(find_object('chair'), each) for each in (run, turned))
    assert (quarter == np.rot90(plain, 1, (0, 1))).all()


def test_truth_that_does_not_fit_is_refused(run, tmp_path):
    write_binvox(VoxelGrid(np.ones((16, 16, 16), np.float32)), tmp_path / 'small.binvox')
    with pytest.raises(ConfigError, match='expected 32 cells a side'):
        read_truth(tmp_path / 'small.binvox', run)
    with pytest.raises(MeshError):
        read_truth(tmp_path / 'missing.glb', run)


def test_iou_is_one_where_the_estimate_is_the_truth(run):
    truth = known_truth(run)
    views = [replace(run.episodes[0].views[0], occupied=VoxelGrid(truth.astype(np.float32)))]
    assert Subject('A', run, changed(run, views=views).episodes[0], truth).ious == [1.0]
    assert Subject('A', run, run.episodes[0]).ious == [None] * 3


def test_shapes_made_up_for_are_those_that_the_loop_would_have_found(run):
    bare = changed(run, views=[replace(view, reconstruction=None, occupied=None, entropy=None)
                               for view in run.episodes[0].views])
    assert lacks_reconstruction(bare)
    assert not lacks_reconstruction(run)
    made = with_reconstruction(bare, Reconstructor.load(threads=1))
    for view, recorded in zip(made.episodes[0].views, run.episodes[0].views, strict=True):
        assert (view.occupied.occupied(0) == recorded.occupied.occupied(0)).all()
        assert view.entropy == recorded.entropy
