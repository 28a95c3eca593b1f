"""
What two workers are worth, beside two independent processes; and what giving out an item costs.

`python -m benchmarks.cluster [--items N] [--refused N] [--address ADDRESS]` prints JSON.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterable
from functools import partial
import json
from pathlib import Path
import resource
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.batch.run import run_batch
from active_recon.batch.task import Task
from active_recon.batch.work import do_bag
from active_recon.cluster import Crew, crew_of
from active_recon.datasets.making import make_object, shape_jobs

_ROOT = Path(__file__).parents[1]
GOLDEN = _ROOT / 'bags' / 'golden' / 'run'
_EMPTY = 20_000
Work = tuple[Callable[[Any], Any], list[Any]]


def rendering(folder: Path, count: int) -> Work:
    """Return the rendering of a number of chairs."""
    return partial(make_object, samples=2), shape_jobs('chair', range(count), folder)


def replaying(folder: Path, count: int) -> Work:
    """Return the replay of a number of copies of the golden run."""
    bags = [folder / 'bags' / f'{number:04d}' for number in range(count)]
    for bag in bags:
        shutil.copytree(GOLDEN, bag)
    task = Task('replay', folder / 'out', Topics(), Scene())
    return partial(do_bag, task, task.identity), bags


WORKS = {'render': rendering, 'replay': replaying}


def rate(results: Iterable[Any]) -> float:
    """Return items a second, from the first result on: what workers load first is left out."""
    times = [time.perf_counter() for _ in results]
    return (len(times) - 1) / (times[-1] - times[0])


def alone(name: str, count: int) -> float:
    """Return the items a second of this process."""
    with TemporaryDirectory() as folder:
        function, items = WORKS[name](Path(folder), count)
        return rate(map(function, items))


def independent(name: str, count: int, processes: int) -> float:
    """Return the items a second of some processes that know nothing of each other, in all."""
    running = [subprocess.Popen([sys.executable, '-m', 'benchmarks.cluster', '--alone', name,
                                 '--items', str(count)], stdout=subprocess.PIPE, cwd=_ROOT)
               for _ in range(processes)]
    return sum(float(each.communicate()[0]) for each in running)


def of_crew(name: str, count: int, crew: Crew) -> float:
    """Return the items a second of workers."""
    with TemporaryDirectory() as folder:
        function, items = WORKS[name](Path(folder), count)
        return rate(crew.map(function, items))


def nothing(item: int) -> int:
    """Do nothing: what is left is the cost of giving out an item and of its result."""
    return item


def refusals(count: int, crew: Crew) -> dict[str, float]:
    """Return the rows a second of so many files that are no bags, and the driver's peak memory."""
    with TemporaryDirectory() as folder:
        archive = Path(folder) / 'archive'
        for number in range(count):
            place = archive / f'{number // 1000:04d}'
            place.mkdir(parents=True, exist_ok=True)
            (place / f'{number:07d}.mcap').write_bytes(b'no bag')
        task = Task('measure', Path(folder) / 'out', Topics(), Scene())
        began = time.perf_counter()
        counts = run_batch(task, [archive], crew)
        took = time.perf_counter() - began
        assert counts.refused == count
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return {'bags': count, 'rows_per_s': count / took, 'driver_peak_mb': peak}


def main() -> None:
    """Measure, and print as JSON."""
    parser = ArgumentParser()
    parser.add_argument('--alone', choices=WORKS)
    parser.add_argument('--items', type=int, default=24)
    parser.add_argument('--refused', type=int, default=10_000)
    parser.add_argument('--address', help='Ray cluster; default: local processes')
    asked = parser.parse_args()
    if asked.alone:
        print(alone(asked.alone, asked.items))  # noqa: T201
        return
    found: dict[str, Any] = {}
    with crew_of(asked.address, 2) as crew:
        list(crew.map(nothing, range(1000)))
        found['items_per_s_of_nothing'] = rate(crew.map(nothing, range(_EMPTY)))
        found['overhead_ms_per_item'] = 1e3 / found['items_per_s_of_nothing']
        if asked.refused:
            found['refused'] = [refusals(count, crew)
                                for count in (asked.refused // 10, asked.refused)]
        for name in WORKS if asked.items else ():
            one = independent(name, asked.items, 1)
            limit = independent(name, asked.items, 2) / one
            gain = of_crew(name, 2 * asked.items, crew) / one
            found[name] = {'one_per_s': one, 'limit_of_two': limit, 'two_workers': gain,
                           'share_of_limit': gain / limit}
    print(json.dumps(found, indent=1))  # noqa: T201


if __name__ == '__main__':
    main()
