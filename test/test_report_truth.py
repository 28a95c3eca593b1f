"""The true shape beside a run, and the shape where a bag holds none."""

from dataclasses import replace
import math
from pathlib import Path

from active_recon.bags.runs.rebuilt import lacks_reconstruction, with_reconstruction
from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import ConfigError, DataError, MeshError
from active_recon.models.weights_files import SHIPPED
from active_recon.objects import find_object
from active_recon.reconstructor import Reconstructor
from active_recon.report.subject import Subject
from active_recon.report.truth import known_truth, TruthFile
from active_recon.volumes.binvox import write_binvox
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
from report_runs import changed, recorded_run
import trimesh


@pytest.fixture(scope='module')
def run(loaded_once: None) -> RecordedRun:
    return recorded_run('chair', 'uniform', 3)


def shown(run, mesh, up=''):
    return replace(run, parameters={'turntable_camera': {'mesh': mesh, 'up': up}})


def cells_of(path, run, *placed, **size):
    return TruthFile(Path(path), *placed).read(run, **size).cells


def test_object_that_ships_is_known_wherever_it_was_installed(run):
    truth = known_truth(shown(run, '/elsewhere/active_recon/objects/chair.glb'))
    assert (truth.cells == cells_of(find_object('chair'), run, True)).all()


@pytest.mark.parametrize(('mesh', 'up'), [
    ('', ''), ('/mine/chair.glb', ''), ('/elsewhere/active_recon/objects/teapot.glb', ''),
    ('/elsewhere/active_recon/objects/chair.glb', 'z')])
def test_truth_of_any_other_object_is_not_known(run, mesh, up):
    assert known_truth(shown(run, mesh, up)) is None


def test_object_that_ships_is_as_large_as_the_camera_showed_it_in_a_larger_cube(run):
    camera = run.parameters['turntable_camera'] | {'object_size': 0.5}
    shown_small = replace(run, parameters={**run.parameters, 'turntable_camera': camera})
    small, whole = known_truth(shown_small), known_truth(run)
    assert "longest side was 0.5 m; the run's cube is 1 m" in small.placed
    assert small.cells.sum() == pytest.approx(whole.cells.sum() / 8, rel=0.2)
    sides = [np.ptp(np.argwhere(cells), axis=0).max() + 1 for cells in (small.cells, whole.cells)]
    assert sides[0] == pytest.approx(sides[1] / 2, abs=2)


@pytest.mark.parametrize('size', [1.0, 0.5])
def test_what_the_camera_showed_stands_as_it_was_shown_whatever_front_was_told(run, size):
    camera = run.parameters['turntable_camera'] | {'object_size': size}
    straight, turned = (known_truth(replace(run, parameters={
        'turntable_camera': camera, 'reconstructor': {'object_size': 1.0, 'object_yaw': yaw}}))
        for yaw in (0.0, 1.0))
    np.testing.assert_array_equal(turned.cells, straight.cells)


def test_mesh_and_its_binvox_are_the_same_truth(run, tmp_path):
    cells = cells_of('chair', run)
    write_binvox(VoxelGrid(cells.astype(np.float32)), tmp_path / 'chair.binvox')
    assert (cells_of(tmp_path / 'chair.binvox', run) == cells).all()


def test_mesh_is_in_metres_and_where_it_stands(run, tmp_path):
    box = trimesh.creation.box(bounds=[(0, 0, 0), (0.25, 0.25, 0.25)])
    box.export(tmp_path / 'box.ply')
    truth = TruthFile(tmp_path / 'box.ply').read(run)
    expected = np.zeros((64, 64, 64), bool)
    expected[32:48, 32:48, 32:48] = True
    assert expected[truth.cells].mean() > 0.6  # and its surface's cells around it
    assert (truth.cells | ~expected).all()
    assert 'in metres and in the' in truth.placed
    assert cells_of(tmp_path / 'box.ply', run, True).mean() > 0.9  # fitted, it fills the cube
    small = cells_of(tmp_path / 'box.ply', run, object_size=0.5)
    assert small[32:, 32:, 32:].mean() > 0.9 and not small[:31].any()


def test_mesh_that_sticks_out_of_the_cube_is_cut_and_the_page_says_so(run, tmp_path):
    trimesh.creation.box((2, 0.5, 0.5)).export(tmp_path / 'bar.ply')
    truth = TruthFile(tmp_path / 'bar.ply').read(run)
    assert truth.cells[:, 20:44, 20:44].all()
    assert '% of its surface is outside of the cube' in truth.placed
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.apply_translation((5, 0, 0))
    box.export(tmp_path / 'far.ply')
    with pytest.raises(DataError, match='outside of the run.s cube.*--fit'):
        TruthFile(tmp_path / 'far.ply').read(run)


def test_mesh_that_fills_the_cube_up_to_rounding_is_inside(run, tmp_path):
    trimesh.creation.box((0.3, 0.3, 0.3)).export(tmp_path / 'full.ply')  # in 32 bits: 0.30000001
    truth = TruthFile(tmp_path / 'full.ply').read(run, object_size=0.3)
    assert truth.cells.all()
    assert 'outside' not in truth.placed


def test_a_mesh_with_a_hole_is_a_shell_and_the_page_says_so(run, tmp_path):
    box = trimesh.creation.box((0.6, 0.6, 0.6))
    box.export(tmp_path / 'whole.ply')
    box.update_faces(np.arange(len(box.faces)) > 1)
    box.export(tmp_path / 'open.ply')
    whole, shell = (TruthFile(tmp_path / f'{name}.ply').read(run) for name in ('whole', 'open'))
    assert shell.cells.sum() < whole.cells.sum() / 4
    assert 'only its surface counts as solid' in shell.placed
    assert 'surface' not in whole.placed


def test_a_mesh_without_an_underside_is_as_solid_as_cameras_can_tell(run, tmp_path):
    box = trimesh.creation.box((0.6, 0.6, 0.6))
    box.export(tmp_path / 'whole.ply')
    box.update_faces(box.face_normals[:, 2] > -0.5)
    box.export(tmp_path / 'scan.ply')
    whole, scan = (TruthFile(tmp_path / f'{name}.ply').read(run) for name in ('whole', 'scan'))
    assert scan.cells.sum() > 0.85 * whole.cells.sum()  # the lowest cameras see the walls' edge
    assert not (scan.cells & ~whole.cells).any()
    assert 'count as solid, since no camera could see that they are not' in scan.placed
    assert 'count as solid' not in whole.placed


def test_axes_of_the_true_mesh_are_options(run, tmp_path):
    box = trimesh.creation.box(bounds=[(0, 0, 0), (0.1, 0.1, 0.4)])
    box.export(tmp_path / 'stick.ply')
    lying = cells_of(tmp_path / 'stick.ply', run, False, 'y', 'z')
    assert lying[40, 34, 34] and not lying[34, 34, 50]


def test_truth_turns_with_the_front_of_the_object_where_it_is_fitted(run):
    turned = replace(run, parameters={'reconstructor': {'object_yaw': math.pi / 2}})
    plain, quarter = (cells_of('chair', each) for each in (run, turned))
    assert (quarter == np.rot90(plain, 1, (0, 1))).all()


def test_truth_that_is_fitted_turns_as_far_as_is_told_beside_the_run(run, tmp_path):
    plain = cells_of('chair', run)
    write_binvox(VoxelGrid(plain.astype(np.float32)), tmp_path / 'chair.binvox')
    turned = replace(run, parameters={'reconstructor': {'object_yaw': 1.0}})
    for path in ('chair', tmp_path / 'chair.binvox'):
        quarter = cells_of(path, turned, True, object_yaw=math.pi / 2)
        assert (quarter == np.rot90(plain, 1, (0, 1))).all()
        assert (cells_of(path, turned, True, object_yaw=0.0) == plain).all()


def test_truth_that_does_not_fit_is_refused(run, tmp_path):
    write_binvox(VoxelGrid(np.ones((16, 16, 16), np.float32)), tmp_path / 'small.binvox')
    with pytest.raises(ConfigError, match='expected 64 cells a side.*got 16'):
        cells_of(tmp_path / 'small.binvox', run)
    write_binvox(VoxelGrid(np.ones((64, 64, 64), np.float32), 0.2), tmp_path / 'other.binvox')
    with pytest.raises(ConfigError, match='got 0.2 m'):
        cells_of(tmp_path / 'other.binvox', run)
    assert cells_of(tmp_path / 'other.binvox', run, True).all()
    assert cells_of(tmp_path / 'other.binvox', run, object_size=0.2).all()
    with pytest.raises(MeshError):
        cells_of(tmp_path / 'missing.glb', run)


def test_iou_is_one_where_the_estimate_is_the_truth(run):
    truth = known_truth(run).cells
    views = [replace(run.episodes[0].views[0], occupied=VoxelGrid(truth.astype(np.float32)))]
    assert Subject('A', run, changed(run, views=views).episodes[0], truth).ious == [1.0]
    assert Subject('A', run, run.episodes[0]).ious == [None] * 3


def test_without_probabilities_just_the_occupied_cells_are_shown(run):
    episode = run.episodes[0]
    bare = replace(episode, views=[replace(view, reconstruction=None) for view in episode.views])
    subject = Subject('A', run, bare)
    for view in subject.views:
        assert (view.occupied.occupied(subject.threshold) == view.occupied.occupied(0)).all()


def test_shapes_made_up_for_are_those_that_the_loop_would_have_found(run):
    bare = changed(run, views=[replace(view, reconstruction=None, occupied=None, entropy=None)
                               for view in run.episodes[0].views])
    assert lacks_reconstruction(bare)
    assert not lacks_reconstruction(run)
    made = with_reconstruction(bare, Reconstructor.load(SHIPPED, threads=1))
    for view, recorded in zip(made.episodes[0].views, run.episodes[0].views, strict=True):
        assert (view.occupied.occupied(0) == recorded.occupied.occupied(0)).all()
        assert view.entropy == recorded.entropy
