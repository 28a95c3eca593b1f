"""
What two workers are worth, beside two independent processes; and what giving out an item costs.

`python -m benchmarks.cluster [--items N] [--refused N] [--address ADDRESS]` prints JSON.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
import json
import os
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
    """
    Return the items a second of this process.

    After the first item it says so, and waits for a line: so that all of them work at one time.
    """
    with TemporaryDirectory() as folder:
        function, items = WORKS[name](Path(folder), count + 1)
        function(items.pop())
        print('ready', flush=True)  # noqa: T201
        sys.stdin.readline()
        begun = time.perf_counter()
        for item in items:
            function(item)
        return count / (time.perf_counter() - begun)


def independent(name: str, count: int, processes: int) -> float:
    """Return the items a second of some processes that know nothing of each other, in all."""
    running = [subprocess.Popen([sys.executable, '-m', 'benchmarks.cluster', '--alone', name,
                                 '--items', str(count)], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True, cwd=_ROOT)
               for _ in range(processes)]
    for each in running:
        assert each.stdout is not None
        each.stdout.readline()
    return sum(float(each.communicate('go\n')[0]) for each in running)


@dataclass(frozen=True)
class Timed:
    """When a process began and ended an item, seconds of a clock that all of them share."""

    process: tuple[str, int]
    begun: float
    ended: float


def timed(function: Callable[[Any], Any], item: Any) -> Timed:
    """Call a function, and tell when and where."""
    begun = time.perf_counter()
    function(item)
    return Timed((os.uname().nodename, os.getpid()), begun, time.perf_counter())


def of_crew(name: str, count: int, crew: Crew) -> dict[str, float]:
    """
    Return what workers of this machine do while all of them work.

    That is from the first result of the last of them to begin, to the last result of the first
    to end: `items_per_s`, and `busy`, the share of their time that goes to items.
    """
    with TemporaryDirectory() as folder:
        function, items = WORKS[name](Path(folder), count)
        done = [result.value for result in crew.map(partial(timed, function), items)]
    each = {process: sorted((one.begun, one.ended) for one in done if one.process == process)
            for process in {one.process for one in done}}
    begun = max(times[0][1] for times in each.values())
    ended = min(times[-1][1] for times in each.values())
    inside = [sum(max(0.0, min(end, ended) - max(begin, begun)) for begin, end in times)
              for times in each.values()]
    shares = [(min(end, ended) - max(begin, begun)) / (end - begin) for times in each.values()
              for begin, end in times if end > begun and begin < ended]
    return {'items_per_s': sum(shares) / (ended - begun),
            'busy': sum(inside) / (ended - begun) / len(each)}


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
            both = of_crew(name, 2 * asked.items, crew)
            gain = both['items_per_s'] / one
            found[name] = {'one_per_s': one, 'limit_of_two': limit, 'two_workers': gain,
                           'share_of_limit': gain / limit, 'busy': both['busy']}
    print(json.dumps(found, indent=1))  # noqa: T201


if __name__ == '__main__':
    main()
