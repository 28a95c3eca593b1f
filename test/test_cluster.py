"""Many items on a Ray cluster and in local processes: the same results, whatever dies."""

from contextlib import nullcontext
from dataclasses import replace
from functools import partial
import gc
from pathlib import Path
import shutil
import signal
import sys
import time
from types import SimpleNamespace

from active_recon.cli import cluster_option, evaluation_plan
from active_recon.cli.evaluation_plan import EvaluationPlan, run_on_crew
from active_recon.cluster import bundles, crew_of, Result
from active_recon.cluster.bundles import attempt_all, Bundles
from active_recon.cluster.local import LocalCrew
from active_recon.cluster.storage import SharedFolder, Storage
from active_recon.cluster.telling import told
from active_recon.errors import ConfigError, WorkError
import cluster_items
from command_line import command, refusal
import pytest
from ray_clusters import ray_cluster, ROOT
import trimesh

DIED = 'its worker died 3 times: expected a result, got none'


@pytest.fixture(scope='module')
def cluster():
    """Return the address of a head and two workers, processes of their own on this machine."""
    with ray_cluster() as started:
        yield started.address


@pytest.fixture(scope='module')
def crews(cluster):
    """Return what opens the workers of either kind."""
    return {'local': lambda: crew_of(None, 2), 'ray': lambda: crew_of(cluster)}


def results(crew, function, items, **more):
    return sorted(crew.map(function, items, **more), key=lambda result: result.index)


def same_files(folder, other):
    """Return whether two trees have the same files with the same bytes."""
    trees = [{path.relative_to(top): path.read_bytes() for path in top.rglob('*')
              if path.is_file()} for top in (folder, other)]
    return bool(trees[0]) and trees[0] == trees[1]


def test_one_process_several_and_a_cluster_give_the_same_results(crews):
    own = results(LocalCrew(1), cluster_items.halved, range(200))
    assert own[2] == Result(2, 1.0)
    assert own[3] == Result(3, None, '3: odd: expected an even number', 'data')
    assert own[5] == Result(5, None, 'ZeroDivisionError: 5 is a fault of the program',
                            'unexpected')
    for opened in crews.values():
        with opened() as crew:
            assert results(crew, cluster_items.halved, iter(range(200))) == own


def test_what_nobody_waits_for_any_more_ends_at_once_and_leaves_nothing(tmp_path):
    begun = time.monotonic()
    found = LocalCrew(2).map(partial(cluster_items.for_ever_but_the_first, tmp_path), range(3))
    assert next(found) == Result(0, 0)
    found.close()
    assert time.monotonic() - begun < 60 and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_auto_is_the_cluster_that_ray_address_names(cluster, monkeypatch):
    monkeypatch.setenv('RAY_ADDRESS', cluster)
    with crew_of('auto') as crew:
        assert crew.workers == 2
        assert results(crew, cluster_items.halved, range(8)) == results(
            LocalCrew(1), cluster_items.halved, range(8))


@pytest.mark.parametrize('kind', ['local', pytest.param('ray', marks=pytest.mark.slow)])
def test_what_a_dying_worker_had_is_done_again_and_no_item_is_lost_or_doubled(
        crews, kind, tmp_path):
    with crews[kind]() as crew:
        found = results(crew, partial(cluster_items.dying, tmp_path), range(8))
    assert [result.index for result in found] == list(range(8))
    assert found[5] == Result(5, None, DIED, 'worker_died')
    assert [result.value for result in found if result.index != 5] == [0, 1, 2, 3, 4, 6, 7]
    assert (tmp_path / '2-1').exists()


@pytest.mark.parametrize('kind', ['alone', 'local', pytest.param('ray', marks=pytest.mark.slow)])
def test_an_item_that_asks_its_process_to_end_ends_no_other(crews, kind):
    opened = crews.get(kind, lambda: crew_of(None, 1))
    with opened() as crew:
        found = results(crew, cluster_items.ending, range(8))
    assert [result.value for result in found if result.index not in (1, 2)] == [0, 3, 4, 5, 6, 7]
    asked = (DIED, 'worker_died') if kind == 'ray' else (
        'RuntimeError: it asked its process to end: SystemExit: of a parser', 'unexpected')
    assert found[1] == Result(1, None, *asked)
    assert found[2] == Result(2, None, 'Panic: of a library', 'unexpected')


def test_ctrl_c_and_a_closed_terminal_are_the_driver_s():
    kinds = [signal.SIGINT, signal.SIGHUP]
    assert [result.value for result in results(LocalCrew(2), cluster_items.signalled, kinds)
            ] == kinds


@pytest.fixture
def heard():
    """Ctrl-C is heard, also where the tests run in the background of a shell, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_workers_that_still_import_without_a_word(heard, capfd):
    [found] = results(LocalCrew(2), cluster_items.InterruptedAtStart(), range(1))
    assert found == Result(0, None, DIED, 'worker_died')
    assert not capfd.readouterr().err


@pytest.mark.parametrize('kind', ['local', pytest.param('ray', marks=pytest.mark.slow)])
def test_items_are_drawn_as_workers_have_room_for_them(crews, kind):
    drawn = done = most = 0

    def items():
        nonlocal drawn
        for number in range(3000):
            drawn += 1
            yield number

    with crews[kind]() as crew:
        for _ in crew.map(cluster_items.halved, items()):
            most = max(most, drawn - done)
            done += 1
    assert done == 3000
    assert most <= 64 * 2 * 4


def test_a_bundle_of_items_that_take_longer_than_those_before_is_given_back(monkeypatch):
    monkeypatch.setattr(bundles, '_LONGEST', 0.0)
    done = attempt_all(cluster_items.quick_at_first, [40, 41, 42])
    assert [outcome.value for outcome in done.outcomes] == [40]
    left = Bundles(range(100))
    left.learn(done)
    left.separate([(1, 41), (2, 42)])
    assert [left.draw(), left.draw()] == [[(1, 41)], [(2, 42)]]


@pytest.mark.parametrize('kind', ['local', pytest.param('ray', marks=pytest.mark.slow)])
def test_no_item_of_a_bundle_that_is_given_back_is_lost_or_doubled(crews, kind):
    with crews[kind]() as crew:
        found = results(crew, cluster_items.quick_at_first, range(44))
    assert [result.value for result in found] == list(range(44))


@pytest.mark.slow
def test_an_error_in_the_middle_of_the_work_starts_no_other_ray(crews):
    import ray

    with pytest.raises(RuntimeError, match='in the middle'), crews['ray']() as crew:
        for _ in crew.map(cluster_items.quick_at_first, range(60)):
            raise RuntimeError('in the middle')
    gc.collect()
    assert not ray.is_initialized()


@pytest.mark.parametrize('kind', ['local', pytest.param('ray', marks=pytest.mark.slow)])
def test_a_full_disk_stops_the_work_with_one_error(crews, kind):
    with crews[kind]() as crew, pytest.raises(
            WorkError, match='no room to write: .*No space left .*start again'):
        list(crew.map(cluster_items.without_room, range(100)))


@pytest.mark.slow
def test_a_machine_that_does_not_see_a_path_says_which(crews, tmp_path):
    missing = tmp_path / 'archive'
    with crews['ray']() as crew, pytest.raises(
            WorkError, match=f'{missing}: not seen by .*: expected it on storage that all'):
        list(crew.map(cluster_items.halved, range(4), reads=[missing]))
    folder = SharedFolder.of(tmp_path / 'out')
    Storage(folder, (tmp_path,)).require()
    with pytest.raises(WorkError, match='out: not seen by'):
        replace(folder, mark='of another disk').require()
    folder.forget()
    assert not list((tmp_path / 'out').iterdir())


def test_work_that_ends_leaves_other_work_in_its_folder(tmp_path):
    first, second = SharedFolder.of(tmp_path), SharedFolder.of(tmp_path)
    first.forget()
    second.require()
    second.forget()
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_batch_of_bags_is_the_same_on_a_cluster_and_a_bag_that_is_none_is_refused(
        cluster, tmp_path, monkeypatch, capsys):
    archive = tmp_path / 'archive'
    for name in ('2026/a', '2026/b', '2027/c'):
        shutil.copytree(ROOT / 'bags' / 'golden' / 'paper', archive / name)
    (archive / '2026' / 'poisonous.mcap').write_bytes(b'no bag')
    for name, where in (('local', ['--workers', 1]), ('ray', ['--cluster', cluster])):
        assert command(monkeypatch, 'batch', 'measure', archive, '--out', tmp_path / name,
                       *where) == 0
        assert '4 bags' in capsys.readouterr().out
    assert same_files(tmp_path / 'local', tmp_path / 'ray')


@pytest.mark.slow
def test_rendered_objects_are_the_same_on_a_cluster(cluster, tmp_path, monkeypatch):
    for name, mesh in (('box', trimesh.creation.box((0.3, 0.2, 0.1))),
                       ('ball', trimesh.creation.icosphere(1, 0.2))):
        (tmp_path / 'meshes' / name).mkdir(parents=True)
        mesh.export(tmp_path / 'meshes' / name / 'a.stl')
    monkeypatch.chdir(tmp_path)  # workers begin in folders of their own
    for name, where in (('local', ['--workers', 1]), ('ray', ['--cluster', cluster])):
        assert command(monkeypatch, 'render', 'meshes', name, '--samples', 1, *where) == 0
    assert same_files(tmp_path / 'local', tmp_path / 'ray')


@pytest.mark.parametrize('split', ['splits.json', 'sorted', None])
def test_workers_of_an_evaluation_find_its_split_file_from_any_folder(
        tmp_path, monkeypatch, split):
    monkeypatch.chdir(tmp_path)
    asked = []
    monkeypatch.setattr(evaluation_plan, 'run_blocks', lambda *given: asked.extend(given))
    plan = EvaluationPlan(tmp_path / 'data', (), 5, 4, 5, 0, split, True, 1)
    run_on_crew(plan, Path('a.safetensors'), None, (), None)
    prepare, *_, reads, _ = asked
    is_file = split == 'splits.json'
    assert prepare.args[0].split_file == (str(tmp_path / split) if is_file else split)
    assert (tmp_path / 'splits.json' in reads) == is_file


def test_without_ray_or_a_cluster_the_error_says_what_to_do(monkeypatch, capsys, tmp_path):
    arguments = ['dataset', 'build', tmp_path, '--cluster']
    for address in ('far away', 'head', 'ray://head'):
        assert "invalid address: expected 'auto', 'local', 'ray://HOST:PORT' or 'HOST:PORT', " \
            f"got '{address}'" in refusal(monkeypatch, capsys, *arguments, address)
    for address in ('127.0.0.1:9', 'ray://127.0.0.1:9'):
        assert f'no cluster at {address}: expected a Ray that runs there' in refusal(
            monkeypatch, capsys, *arguments, address)
    monkeypatch.setitem(sys.modules, 'ray', None)
    assert 'pip install active_recon[cluster]' in refusal(
        monkeypatch, capsys, *arguments, 'auto')


def test_a_cluster_that_has_no_worker_yet_is_told(monkeypatch, capsys):
    for workers in (0, 1):
        crew = SimpleNamespace(workers=workers, dashboard='')
        monkeypatch.setattr(cluster_option, 'crew_of', lambda *_, crew=crew: nullcontext(crew))
        with cluster_option.workers_of('head:6379', None) as found:
            assert found is crew
        assert ('no CPUs at head:6379: the work begins once a machine joins' in
                capsys.readouterr().err) == (workers == 0)


def test_progress_tells_the_rate_the_workers_and_the_refused():
    notes = []
    crew = LocalCrew(1)
    found = list(told(crew.map(cluster_items.halved, range(6)), crew,
                      lambda steps, note: notes.append((steps, note)),
                      lambda result: bool(result.refusal)))
    assert [steps for steps, _ in notes] == [1] * len(found) == [1] * 6
    assert notes[-1][1].endswith('/s, 1 worker, 2 refused')


def test_work_that_must_stop_stops(crews):
    with pytest.raises(WorkError, match='2: not seen'), crews['local']() as crew:
        list(crew.map(cluster_items.that_stops, range(10)))
    with pytest.raises(ConfigError, match='invalid address'), crew_of('ray:/x'):
        pass
