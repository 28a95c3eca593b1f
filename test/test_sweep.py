"""A sweep: every view of a turntable in one bag, as its camera would have streamed it."""

import math

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.sweep import IMAGES_EACH, record_sweep
from active_recon.cli.main import app
from active_recon.errors import MeshError, RecordingError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS
from active_recon.report.truth import known_truth
from active_recon.simulation.shown_object import rendered_object
import numpy as np
import pytest
from recorded_messages import errors_in, small_disk
from rosbags.rosbag2 import Reader
import trimesh
from typer.testing import CliRunner

BEGIN = 1_700_000_000_000_000_000


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp('mesh') / 'box.ply'
    trimesh.creation.box((1, 0.6, 0.4)).export(path)
    return rendered_object(path)


@pytest.fixture
def sweep(shown, tmp_path):
    record_sweep(shown, tmp_path / 'sweep', BEGIN)
    return tmp_path / 'sweep'


def test_of_an_object_that_ships_the_truth_is_known(shown, tmp_path):
    for number, (mesh, is_known) in enumerate((({'mesh': 'chair'}, True), ({}, False),
                                               ({'mesh': 'chair', 'up': 'x'}, False))):
        folder = tmp_path / str(number)
        record_sweep(shown, folder, BEGIN, mesh=mesh)
        assert (known_truth(read_run(folder)) is not None) == is_known


def test_every_azimuth_is_a_view_as_it_was_rendered(shown, sweep):
    run = read_run(sweep)
    (episode,) = run.episodes
    assert run.provenance['object'] == 'box.ply'
    assert run.parameters['turntable_camera'] == {'object_size': 1.0}
    assert len(episode.views) == len(AZIMUTHS)
    for view, azimuth, image in zip(episode.views, AZIMUTHS, shown.images, strict=True):
        assert azimuth_difference(view.camera.azimuth, azimuth) == pytest.approx(0, abs=1e-9)
        assert view.camera.elevation == pytest.approx(math.radians(30))
        assert np.array_equal(view.image, image)


def test_it_opens_elsewhere_and_holds_three_topics_of_equal_length(sweep):
    assert [errors_in(path) for path in sweep.glob('*.mcap')] == [[]]
    with Reader(sweep) as reader:
        assert {connection.topic: connection.msgcount for connection in reader.connections} == {
            f'/camera/{name}': IMAGES_EACH * len(AZIMUTHS)
            for name in ('image_raw', 'camera_info', 'pose')}
        assert BEGIN < reader.start_time < BEGIN + 10_000_000


def test_what_is_there_is_not_written_over_and_what_fails_leaves_nothing(shown, sweep, tmp_path):
    with pytest.raises(RecordingError, match='exists already'):
        record_sweep(shown, sweep)
    with small_disk(2000), pytest.raises(RecordingError):
        record_sweep(shown, tmp_path / 'another')
    assert [path.name for path in tmp_path.iterdir()] == ['sweep']


def test_the_command_records_any_mesh_and_refuses_what_is_none(tmp_path):
    trimesh.creation.box((1, 0.6, 0.4)).export(tmp_path / 'box.ply')
    done = CliRunner().invoke(app, [
        'record-sweep', str(tmp_path / 'box.ply'), '--out', str(tmp_path / 'sweep')])
    assert done.exit_code == 0 and '24 views of box.ply' in done.stdout
    refused = CliRunner().invoke(app, ['record-sweep', 'nonsense', '--out', str(tmp_path / 'no')])
    assert isinstance(refused.exception, MeshError) and not (tmp_path / 'no').exists()
