"""What processes hold in memory over a time, read from /proc."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np

_PARTS = 10


@dataclass(frozen=True)
class MemoryUse:
    """Of one process, MB: when it was warm, at the end, and the most."""

    warm_mb: float
    end_mb: float
    growth_mb: float
    peak_mb: float


class Memory:
    """Samples the resident memory of processes, by their names and ids."""

    def __init__(self, processes: Mapping[str, int]) -> None:
        self._processes = dict(processes)
        self._samples: dict[str, list[float]] = {name: [] for name in processes}

    def sample(self) -> None:
        """Note what each holds now."""
        for name, pid in self._processes.items():
            self._samples[name].append(resident_mb(pid))

    def use(self) -> dict[str, MemoryUse]:
        """
        Return the use of each process.

        The first tenth of the samples is left out as its warming up; what is warm, and what is
        the end, is the median of the tenth that follows, and of the last. NaN of fewer than two.
        """
        return {name: _use(np.array(samples)) for name, samples in self._samples.items()}


def _use(samples: np.ndarray) -> MemoryUse:
    if len(samples) < 2:
        return MemoryUse(math.nan, math.nan, math.nan, math.nan)
    part = max(len(samples) // _PARTS, 1)
    warm, end = np.median(samples[part:2 * part]), np.median(samples[-part:])
    return MemoryUse(float(warm), float(end), float(end - warm), float(samples.max()))


def resident_mb(pid: int) -> float:
    """Return what a process holds in memory now, MB."""
    return _status_mb(pid, 'VmRSS')


def peak_mb(pid: int) -> float:
    """Return the most that a process has held in memory, MB."""
    return _status_mb(pid, 'VmHWM')


def _status_mb(pid: int, key: str) -> float:
    for line in Path(f'/proc/{pid}/status').read_text().splitlines():
        if line.startswith(f'{key}:'):
            return int(line.split()[1]) * 1024 / 1e6
    raise RuntimeError(f'no memory figure for process {pid}')
