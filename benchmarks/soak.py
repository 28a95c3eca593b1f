"""
The loop in operation for a long time: object after object, recorded, and what became of it.

    python -m benchmarks.soak --minutes 60

A simulated turntable shows one object after another, each is an episode of five views, and all of
it is recorded. Written are `soak.json` and `soak.md`: whether every episode was whole, how long
the views took, and what each process held in memory. The exit code is 1 where a goal was missed
other than those of the latency, which depend on what else runs.
"""

import argparse
from dataclasses import asdict, dataclass
import json
import math
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from active_recon.bags.storage.metadata import yaml_mapping
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import ActiveReconError
from active_recon.launching.processes import NodeProcesses, private_environment
from active_recon.nodes.runtime.run import one_line
from benchmarks.memory import Memory, MemoryUse
from benchmarks.soak_monitor import soak_monitor, SoakMonitor

VIEWS = 5
IMAGES_PER_S = 5.0
SPEED_UP = 4.0
GROWTH_GOAL_MB = 5.0
P50_GOAL_MS, P99_GOAL_MS = 25.0, 60.0
FLAGGED = '/reconstructor warned/unusual_views'
"""The warning that the test of unusual views gives by mistake, in a share of the views."""
FALSE_ALARMS = 0.05
"""That share, which the test was calibrated to."""
DOCS = Path(__file__).parents[1] / 'docs'
_CATEGORIES = ('chair', 'lamp', 'table')
_SAMPLE_EVERY_S = 2.0
_BUDGET_S = 60.0


@dataclass(frozen=True)
class Soak:
    """
    What a soak measured.

    `views` and `recorded_views` are those seen and those in the bag, `whole` the episodes that
    had as many as they should, `broken_by` what ended the soak before its time, '' where nothing
    did. The percentiles are of the time from an image's stamp to its occupancy heard.
    """

    command: str
    minutes: float
    cores: int
    load: float
    episodes: int
    whole: int
    views: int
    recorded_views: int
    faults: dict[str, int]
    broken_by: str
    latency_p50_ms: float
    latency_p99_ms: float
    memory: dict[str, MemoryUse]
    recorded_mb: float

    @property
    def lost(self) -> dict[str, int]:
        """The faults but for views that were flagged as unusual."""
        return {name: count for name, count in self.faults.items() if name != FLAGGED}

    @property
    def flagged(self) -> int:
        """How many views were flagged as unusual, all of them by mistake."""
        return self.faults.get(FLAGGED, 0)

    @property
    def missed(self) -> list[str]:
        """What was not reached, in words, but for the latencies, which are of idle machines."""
        missed = [f'{name}: {count}' for name, count in self.lost.items()]
        if self.flagged > FALSE_ALARMS * self.views:
            missed.append(f'{self.flagged} views flagged as unusual')
        if self.broken_by:
            missed.append(self.broken_by)
        if self.whole < self.episodes:
            missed.append(f'{self.episodes - self.whole} episodes without their {VIEWS} views')
        if self.recorded_views < self.views:
            missed.append(f'{self.views - self.recorded_views} views are not in the bag')
        growth = self.memory['reconstructor'].growth_mb
        if math.isnan(growth):
            missed.append('memory was sampled too rarely to tell any growth')
        elif growth >= GROWTH_GOAL_MB:
            missed.append(f'the reconstructor grew by {growth:.1f} MB')
        return missed

    @property
    def slow(self) -> list[str]:
        """Which goals of the latency were not reached, in words, however busy the machine was."""
        return [f'{name} of the latency: {value:.1f} ms' for name, value, goal in (
            ('p50', self.latency_p50_ms, P50_GOAL_MS), ('p99', self.latency_p99_ms, P99_GOAL_MS))
            if value > goal]


def soak(minutes: float) -> Soak:
    """Run the loop for so many minutes, and to the end of the episode that is open then."""
    environment = private_environment()
    os.environ.update(environment)  # for the observer in this process
    with (TemporaryDirectory() as folder,
          NodeProcesses(Path(folder), environment) as nodes, soak_monitor(nodes.check) as watch):
        bags = _start(nodes, Path(folder))
        memory = Memory({name: nodes.pid(name) for name in (
            'recorder', 'turntable_camera', 'reconstructor', 'view_planner')})
        watch.wait_done(_BUDGET_S)
        broken_by, load = _follow(watch, memory, 60 * minutes)
        nodes.stop()
        size = sum(path.stat().st_size for path in bags.rglob('*') if path.is_file())
        return Soak(
            f'python -m benchmarks.soak --minutes {minutes:g}', minutes, os.cpu_count() or 1, load,
            len(watch.views), watch.views.count(VIEWS), sum(watch.views), _recorded_views(bags),
            dict(watch.faults), broken_by, watch.latency_ms(50), watch.latency_ms(99),
            memory.use(), size / 1e6)


def _start(nodes: NodeProcesses, folder: Path) -> Path:
    """Start the four nodes; return the folder of the bags."""
    objects, bags = folder / 'objects', folder / 'bags'
    for category in _CATEGORIES:
        list(make_dataset(shape_jobs(category, range(2), objects), samples=1))
    nodes.start('recorder', {'output_dir': bags})
    nodes.start('turntable_camera', {
        'dataset': objects, 'rate': IMAGES_PER_S, 'time_scale': SPEED_UP})
    nodes.start('reconstructor', {'take_views': 'at_goal', 'output_dir': folder})
    nodes.start('view_planner', {'max_views': VIEWS, 'entropy_tolerance': 0.0})
    return bags


def _follow(watch: SoakMonitor, memory: Memory, seconds: float) -> tuple[str, float]:
    """
    Show the next object after each.

    Return what ended it before its time, and the machine's mean load, in busy processes.
    """
    end = time.monotonic() + seconds
    due, loads, broken_by = 0.0, [], ''
    watch.begin()
    try:
        while time.monotonic() < end:
            watch.call('next_object', _BUDGET_S)
            watch.wait_done(_BUDGET_S)
            if time.monotonic() >= due:
                memory.sample()
                loads.append(os.getloadavg()[0])
                due = time.monotonic() + _SAMPLE_EVERY_S
    except ActiveReconError as error:
        broken_by = one_line(error)
    return broken_by, sum(loads) / max(len(loads), 1)


def _recorded_views(bags: Path) -> int:
    folder, = bags.iterdir()
    path = folder / 'metadata.yaml'
    information = yaml_mapping(path.read_bytes(), str(path))['rosbag2_bagfile_information']
    return next(each['message_count'] for each in information['topics_with_message_count']
                if each['topic_metadata']['name'] == '/view')


def as_markdown(result: Soak) -> str:
    """Return the page that tells what was measured."""
    rows = [f'| `{name}` | {use.warm_mb:.1f} | {use.end_mb:.1f} | {use.growth_mb:+.1f} '
            f'| {use.peak_mb:.1f} |' for name, use in result.memory.items()]
    missed = '; '.join([*result.missed, *result.slow]) or 'nothing'
    return '\n'.join([
        '# The loop over a long time', '',
        f'`{result.command}` on {result.cores} cores with {result.load:.1f} busy processes on '
        f"average, others' included. A simulated turntable ({SPEED_UP:g} times as fast as in "
        f'operation, {IMAGES_PER_S:g} images a second) showed one object after another, each an '
        f'episode of {VIEWS} views; everything was recorded.', '',
        '| | measured | goal |', '|---|---|---|',
        f'| whole episodes, of {VIEWS} views | {result.whole} | {result.episodes} |',
        f'| views recorded | {result.recorded_views} | at least {result.views} |',
        f'| refusals, warnings and losses | {sum(result.lost.values())} | 0 |',
        f'| views flagged as unusual | {result.flagged} '
        f'| at most {FALSE_ALARMS:.0%} of the views |',
        f'| image stamped to occupancy heard, p50 | {result.latency_p50_ms:.1f} ms '
        f'| {P50_GOAL_MS:g} ms on two idle cores |',
        f'| the same, p99 | {result.latency_p99_ms:.1f} ms '
        f'| {P99_GOAL_MS:g} ms on two idle cores |',
        f'| recorded | {result.recorded_mb:.0f} MB | |', '',
        f'Memory of each process, MB: after a tenth of the time, at the end, and the most. The '
        f'goal is a reconstructor that grows by less than {GROWTH_GOAL_MB:g} MB.', '',
        '| process | warm | at the end | growth | most |', '|---|---|---|---|---|', *rows, '',
        f'Missed: {missed}.', ''])


def main() -> None:
    """Run, print the page, write it."""
    parser = argparse.ArgumentParser(description='The loop over a long time.')
    parser.add_argument('--minutes', type=float, default=60.0)
    parser.add_argument('--output-dir', type=Path, default=DOCS)
    options = parser.parse_args()
    result = soak(options.minutes)
    options.output_dir.mkdir(parents=True, exist_ok=True)
    (options.output_dir / 'soak.json').write_text(json.dumps(asdict(result), indent=1) + '\n')
    (options.output_dir / 'soak.md').write_text(as_markdown(result))
    print(as_markdown(result))  # noqa: T201
    raise SystemExit(1 if result.missed else 0)


if __name__ == '__main__':
    main()
