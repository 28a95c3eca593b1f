"""What a recorded run costs afterwards: its replay, and the page that tells of it."""

from pathlib import Path
import subprocess
import sys
import tempfile
import time

from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import read_run
from benchmarks.figures import Figure

GOLDEN = Path(__file__).parents[1] / 'bags' / 'golden' / 'run'


def replay_figure() -> Figure:
    """Measure how much faster than the run the golden run is read and replayed."""
    settings = recorded_setup(read_run(GOLDEN))
    loop = settings.load_reconstructor(), settings.load_planner()

    def once() -> float:
        began = time.perf_counter()
        run = read_run(GOLDEN)
        verify(run, *loop)
        return (run.end - run.begin) / 1e9 / (time.perf_counter() - began)

    once()
    return Figure('a run read and replayed, against its own time', 'times as fast',
                  [once() for _ in range(10)], 20, more_is_better=True)


def report_figure() -> Figure:
    """Measure how long the whole command takes to make the golden run's page."""
    samples = []
    with tempfile.TemporaryDirectory() as folder:
        for again in range(3):
            began = time.perf_counter()
            subprocess.run([sys.executable, '-m', 'active_recon.cli.main', 'report', GOLDEN,
                            '--out', Path(folder) / f'{again}.html'],
                           check=True, stdout=subprocess.DEVNULL)
            samples.append(time.perf_counter() - began)
    return Figure('a report made, the whole command', 's', samples, 5)
