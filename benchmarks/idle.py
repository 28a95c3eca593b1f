"""What a loop costs while nothing happens: the processor time of its nodes without images."""

import time

from benchmarks.figures import Figure
from benchmarks.goal import cpu_seconds, LOOP, loop_processes

_SETTLE_S, _SPAN_S, _SPANS = 6.0, 5.0, 4


def idle_figure() -> Figure:
    """Return the share of one core that reconstructor and planner use without a camera."""
    samples = []
    with loop_processes() as nodes:
        pids = [nodes.pid(node) for node in LOOP]
        time.sleep(_SETTLE_S)
        for _ in range(_SPANS):
            before, start = cpu_seconds(pids), time.monotonic()
            time.sleep(_SPAN_S)
            samples.append(100 * (cpu_seconds(pids) - before) / (time.monotonic() - start))
    return Figure('processor time of an idle loop, of one core', '%', samples, 3)

