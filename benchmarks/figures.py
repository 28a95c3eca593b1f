"""What every benchmark returns, and the reference that makes machines comparable."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import os
from pathlib import Path
import platform
import re
import time

import numpy as np

_UNITS = ('amx_bf16', 'avx512_bf16', 'avx512_vnni', 'avx512f', 'avx2')


@dataclass(frozen=True)
class Figure:
    """A measured quantity: its samples in `unit`, what of them is judged, and any goal."""

    name: str
    unit: str
    samples: Sequence[float]
    goal: float | None
    percentile: float = 50.0
    more_is_better: bool = False

    @property
    def value(self) -> float:
        """The percentile that is judged."""
        return float(np.percentile(self.samples, self.percentile))

    @property
    def spread(self) -> tuple[float, float]:
        """The samples' 5th and 95th percentiles."""
        low, high = np.percentile(self.samples, [5, 95])
        return float(low), float(high)

    @property
    def reached(self) -> bool:
        """Whether the goal is reached, if there is one."""
        if self.goal is None:
            return True
        return self.value >= self.goal if self.more_is_better else self.value <= self.goal


def timed_ms(task: Callable[[], object], repeats: int, warm_up: int = 3) -> list[float]:
    """Return how long each of `repeats` calls took, milliseconds."""
    for _ in range(warm_up):
        task()
    samples = []
    for _ in range(repeats):
        start = time.perf_counter()
        task()
        samples.append(1e3 * (time.perf_counter() - start))
    return samples


def interleaved(tasks: Mapping[str, Callable[[], object]],
                repeats: int = 40) -> dict[str, list[float]]:
    """Return how long each of some tasks took, milliseconds, in turns: they share what slows."""
    samples: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(repeats + 2):
        for name, task in tasks.items():
            start = time.perf_counter()
            task()
            if turn >= 2:
                samples[name].append(1e3 * (time.perf_counter() - start))
    return samples


def machine() -> str:
    """Return the processor of this machine, its widest units and its threads, in words."""
    file = Path('/proc/cpuinfo')
    told = file.read_text() if file.is_file() else ''
    named = re.search(r'^model name\s*: (.*)$', told, re.M)
    units = next((f' with {each}' for each in _UNITS if re.search(rf'\b{each}\b', told)), '')
    return f'{named[1] if named else platform.machine()}{units}, {os.cpu_count()} threads'


def reference_ms() -> float:
    """
    Return the median time of the reference on this machine, now, milliseconds.

    It is a product of two 512 x 512 float32 matrices in numpy. Figures are told as multiples of
    it too, so that they can be compared from one machine, and one day, to another.
    """
    rng = np.random.default_rng(0)
    a, b = rng.random((2, 512, 512), dtype=np.float32)
    return float(np.median(timed_ms(lambda: a @ b, 50)))
