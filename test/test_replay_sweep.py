"""A sweep bag under every policy: it has all the views that any of them may ask for."""

from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.sweep import record_sweep
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, orbit_camera
from active_recon.models.weights_files import PAPER_MODEL
from active_recon.policies import POLICIES
from active_recon.simulation.shown_object import ShownObject
from command_line import command
import numpy as np
import pytest
from recorded_runs import image_at

pytestmark = pytest.mark.usefixtures('loaded_once')


@pytest.fixture(scope='module')
def sweep(tmp_path_factory):
    return sweep_of(AZIMUTHS, tmp_path_factory.mktemp('bags') / 'sweep')


def sweep_of(azimuths, folder):
    shown = ShownObject('nothing', [image_at(azimuth) for azimuth in azimuths],
                        [orbit_camera(azimuth) for azimuth in azimuths])
    record_sweep(shown, folder, begin=10**18)
    return folder


def replayed(monkeypatch, capsys, *arguments):
    """Replay with the command; return its exit code and what it said."""
    code = command(monkeypatch, 'replay', *arguments)
    said = capsys.readouterr()
    return code, said.out + said.err


def test_a_sweep_has_nothing_to_compare_and_says_so(tmp_path, monkeypatch, capsys):
    sweep = sweep_of(AZIMUTHS[::6], tmp_path / 'sweep')
    code, said = replayed(monkeypatch, capsys, sweep)
    assert code == 0
    [told] = [line for line in said.splitlines() if 'reconstructed' in line]
    assert told.startswith('reconstructed from 4 views: ')
    assert told.endswith('the bag has no record to compare with')
    assert 'compared' not in said


def test_a_replay_warns_where_the_network_is_not_run_as_asked_for(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr('active_recon.runtimes.precision._flags', frozenset)
    sweep = sweep_of(AZIMUTHS[:1], tmp_path / 'sweep')
    for more in ((), ('--threshold', 0.5)):
        code, said = replayed(monkeypatch, capsys, sweep, '--precision', 'int8', *more)
        assert code == 0
        assert said.count('warning: the precision auto instead of int8: precision: int8 is') == 1


@pytest.mark.parametrize('policy', [
    name if name in ('attention', 'farthest') else pytest.param(name, marks=pytest.mark.slow)
    for name in POLICIES])
def test_each_policy_takes_the_views_that_it_asks_for(
        sweep, tmp_path, policy, monkeypatch, capsys):
    out = tmp_path / policy
    code, said = replayed(monkeypatch, capsys, sweep, '--policy', policy, '--out', out,
                          '--model', PAPER_MODEL)
    assert code == 0, said
    (episode,) = read_run(out).episodes
    goals = [episode.first_goal, *(view.goal for view in episode.views[:-1])]
    for goal, view in zip(goals, episode.views, strict=True):
        away = azimuth_difference(goal.camera.azimuth, view.camera.azimuth)
        assert abs(away) <= np.radians(7.5) + 1e-9
    assert episode.done in ('max_views', 'entropy_settled')
    code, said = replayed(monkeypatch, capsys, out)
    assert code == 0
    assert said.endswith('same bits: recording and replay\n')
