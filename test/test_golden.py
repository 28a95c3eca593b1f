"""The golden run: recorded from the real loop, and replayed here to what was recorded."""

from dataclasses import replace
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

from active_recon.bags.replay.comparison import NOTHING_RECORDED, SAME_BITS, WITHIN_TOLERANCE
from active_recon.bags.replay.replay import replay, replay_hash
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.run_writing import write_run
from active_recon.bags.runs.topics import Topics
from active_recon.errors import ConfigError
from active_recon.geometry.view_distance import view_distance
from active_recon.models.weights_files import find_weights, PAPER_MODEL, weights_hash
from command_line import command
import pytest

ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / 'bags' / 'golden'
pytestmark = pytest.mark.usefixtures('loaded_once')
PAPER = GOLDEN / 'paper'  # its network, with its policy; `run` is with the default of both


@pytest.fixture(scope='module', params=['run', 'paper'])
def golden(request):
    """Return the folder of a golden run."""
    return GOLDEN / request.param


other_slow = pytest.mark.parametrize(
    'golden', ['paper', pytest.param('run', marks=pytest.mark.slow)], indirect=True)
of_one = pytest.mark.parametrize('golden', ['paper'], indirect=True)


@pytest.fixture(scope='module')
def run(golden):
    return read_run(golden)


@pytest.fixture(scope='module', autouse=True)
def same_weights(run):
    """Fail every test with the reason where the run was made with weights of another day."""
    recorded = run.provenance['weights_sha256']
    shipped = weights_hash(find_weights(PAPER_MODEL if run.path == PAPER else None))
    if recorded != shipped:
        pytest.fail(f'the weights that ship ({shipped[:12]}) are not those that the golden run '
                    f'was recorded with ({recorded[:12]}): record it anew by `make golden`')


@pytest.fixture(scope='module')
def loop(run, loaded_once):
    """Return the reconstructor and the planner that the run was made with."""
    settings = recorded_setup(run)
    return settings.load_reconstructor(), settings.load_planner()


@pytest.fixture(scope='module')
def verified(run, loop):
    """Return what a replay of the run was found to be."""
    return verify(run, *loop)


def told(monkeypatch, capsys, *arguments):
    """Run a command; return its exit code and what it said."""
    code = command(monkeypatch, *arguments)
    said = capsys.readouterr()
    return code, said.out + said.err


@of_one
def test_what_the_loop_had_is_not_given_again(golden, run):
    for topics, option in ((Topics(object_frame='table'), '--object-frame'),
                           (Topics(max_pose_gap=5.0), '--max-pose-gap')):
        with pytest.raises(ConfigError, match=f'^{option}: not needed: the bag has that of its'):
            read_run(golden, topics)


def test_it_is_small_and_says_what_made_it(golden, run):
    assert sum(path.stat().st_size for path in golden.rglob('*')) < 2_000_000
    assert {'version', 'weights_sha256', 'config_sha256', 'policy', 'seed', 'object'} <= set(
        run.provenance)
    assert [(len(episode.views), episode.done) for episode in run.episodes] == [(4, 'max_views')]


def test_its_goals_were_reached_by_its_views(run):
    views = run.episodes[0].views
    goals = [run.episodes[0].first_goal, *(view.goal for view in views[:-1])]
    for goal, view in zip(goals, views, strict=True):
        assert view_distance(goal.camera, view.camera) < 0.14


def test_all_of_it_replays_to_what_was_recorded(run, verified):
    assert verified.comparison.verdict in (SAME_BITS, WITHIN_TOLERANCE)
    assert {name: found.compared for name, found in verified.comparison.deviations.items()} == {
        'probabilities': 4, 'occupancy': 4, 'latent': 4, 'entropy': 4, 'goal': 3, 'scores': 3,
        'stop': 4, 'quality': sum(view.quality is not None for view in run.episodes[0].views)}


@pytest.mark.parametrize('count', [2, pytest.param(100, marks=pytest.mark.slow)])
def test_all_replays_have_one_hash(run, loop, verified, count):
    assert {replay_hash(replay(run, *loop)) for _ in range(count - 1)} == {verified.hash}


@pytest.mark.parametrize(('variables', 'threads'), [
    pytest.param({'ATEN_CPU_CAPABILITY': 'default'}, 1, marks=pytest.mark.slow),
    pytest.param({'ONEDNN_MAX_CPU_ISA': 'SSE41'}, 1, marks=pytest.mark.slow),
    pytest.param({'ATEN_CPU_CAPABILITY': 'default', 'ONEDNN_MAX_CPU_ISA': 'SSE41'}, 2,
                 marks=pytest.mark.slow)])
def test_another_processor_stays_within_tolerance(golden, variables, threads):
    ended = subprocess.run(
        [sys.executable, '-m', 'active_recon.cli.main', 'replay', golden, '--threads',
         str(threads), '--runtime', 'torch'], capture_output=True, text=True, timeout=600,
        env={**os.environ, **variables, 'PYTHONPATH': str(ROOT)})
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert re.search(f'^({SAME_BITS}|{WITHIN_TOLERANCE}): recording', ended.stdout, re.M)


def test_another_runtime_stays_within_tolerance(run):
    settings = replace(recorded_setup(run), runtime='torch')
    verified = verify(run, settings.load_reconstructor(), settings.load_planner())
    assert verified.comparison.verdict in (SAME_BITS, WITHIN_TOLERANCE)


def test_the_command_tells_the_verdict_and_the_hash(golden, verified, monkeypatch, capsys):
    code, said = told(monkeypatch, capsys, 'replay', golden)
    assert code == 0
    assert f'hash {verified.hash}' in said
    assert f'{verified.comparison.verdict}: recording and replay' in said
    assert 'views: 4, read and replayed in' in said
    assert 'does not name' not in said


@of_one
def test_what_was_recorded_otherwise_is_told_and_ends_with_code_1(
        run, tmp_path, monkeypatch, capsys):
    (episode,) = run.episodes
    views = [replace(view, entropy=view.entropy * 1.01) for view in episode.views]
    write_run(replace(run, episodes=[replace(episode, views=views)]), tmp_path / 'other')
    code, said = told(monkeypatch, capsys, 'replay', tmp_path / 'other')
    assert code == 1
    assert re.search('entropy +4 compared  different +0 of 4 the same, at most 0.0099 apart', said)
    assert said.endswith('different: recording and replay\n')
    assert 'assumed' not in said


@of_one
def test_a_replay_with_another_outcome_tells_what_it_had_to_assume(
        run, tmp_path, monkeypatch, capsys):
    (episode,) = run.episodes
    views = [replace(view, entropy=view.entropy * 1.01) for view in episode.views]
    unsized = {node: {name: value for name, value in values.items() if name != 'object_size'}
               for node, values in run.parameters.items()}
    write_run(replace(run, parameters=unsized, episodes=[replace(episode, views=views)]),
              tmp_path / 'other')
    code, said = told(monkeypatch, capsys, 'replay', tmp_path / 'other')
    assert code == 1
    assert "assumed: the object's cube has a side of 1 m (--object-size)" in said


@of_one
def test_weights_that_are_nowhere_any_more_are_asked_for_by_their_hash(
        run, tmp_path, monkeypatch, capsys):
    lost = run.provenance | {'weights_sha256': '0123456789ab' + 52 * 'c'}
    write_run(replace(run, provenance=lost), tmp_path / 'old')
    code, said = told(monkeypatch, capsys, 'replay', tmp_path / 'old')
    assert code == 2
    assert 'weights not found: expected those of the recording, SHA-256 0123456789ab...' in said
    code, said = told(monkeypatch, capsys, 'replay', tmp_path / 'old', '--model', '2d3d')
    assert code == 0


@pytest.mark.parametrize('golden', ['run'], indirect=True)
def test_a_replay_tells_where_the_bag_does_not_name_its_network(
        run, tmp_path, monkeypatch, capsys):
    unnamed = {name: text for name, text in run.provenance.items() if name != 'weights_sha256'}
    write_run(replace(run, provenance=unnamed), tmp_path / 'old')
    _, said = told(monkeypatch, capsys, 'replay', tmp_path / 'old')
    assert ('the bag does not name its network: that of the options, else the default, was '
            'compared') in said


@pytest.fixture
def copied(golden, tmp_path):
    """Return a copy of the bag that a new one may be written beside."""
    return Path(shutil.copytree(golden, tmp_path / 'walk'))


@other_slow
@pytest.mark.parametrize(('options', 'name', 'knows_policy'), [
    (('--threshold', '0.6'), 'threshold-0.6', True),
    (('--box', '0,0.01,-0.02,1.1'), 'box-1.1', False),
    pytest.param(('--model', '2d3d'), '2d3d', False, marks=pytest.mark.slow),
    pytest.param(('--policy',), '', True, marks=pytest.mark.slow)])
def test_a_replay_with_overrides_is_a_bag_that_replays_to_the_same_bits(
        copied, run, options, name, knows_policy, monkeypatch, capsys):
    if options == ('--policy',):  # its own, which asks for views that there are
        name = run.provenance['policy']
        options = (*options, name)
    code, said = told(monkeypatch, capsys, 'replay', copied, *options)
    beside = copied.with_name(f'walk_{name}')
    assert (code, f'wrote {beside}' in said) == (0, True)
    again = read_run(beside)
    assert again.provenance['replay_of'] == 'walk'
    settings = recorded_setup(again)
    planner = settings.load_planner()
    assert (planner is not None) == knows_policy
    verified = verify(again, settings.load_reconstructor(), planner).comparison
    for quantity, deviation in verified.deviations.items():
        # Goals that were kept are those of the machine that made the golden run
        kept = options[0] == '--threshold' and quantity in ('goal', 'scores')
        expected = {SAME_BITS, WITHIN_TOLERANCE} if kept else {SAME_BITS}
        assert deviation.verdict in expected | {NOTHING_RECORDED}, quantity
    code, said = told(monkeypatch, capsys, 'replay', copied, *options)
    assert (code, 'is not overwritten' in said) == (2, True)


@of_one
def test_a_policy_that_wants_a_view_that_was_never_taken_is_refused(
        tmp_path, monkeypatch, capsys):
    copied = shutil.copytree(PAPER, tmp_path / 'walk')
    code, said = told(monkeypatch, capsys, 'replay', copied, '--policy', 'farthest')
    assert code == 2
    assert 'azimuth 45.0 degrees' in said
    assert 'record-sweep' in said
    assert [path.name for path in copied.parent.iterdir()] == ['walk']


@of_one
def test_a_place_for_a_bag_that_is_not_written_is_refused(tmp_path, monkeypatch, capsys):
    code, said = told(monkeypatch, capsys, 'replay', PAPER, '--out', tmp_path / 'new')
    assert (code, '--out: no bag to write' in said) == (2, True)


@of_one
def test_the_weights_of_the_recording_are_not_named_beside_another_model(monkeypatch, capsys):
    code, said = told(monkeypatch, capsys, 'replay', PAPER, '--weights', 'a.safetensors',
                      '--model', '2d3d')
    assert (code, '--weights beside --model: expected one' in said) == (2, True)
