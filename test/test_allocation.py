"""Freed memory that stays with the process is not mapped again."""

import platform
import subprocess
import sys

import pytest

COUNT = """
import resource, sys
import numpy as np
from active_recon.training.allocation import keep_freed_memory
if sys.argv[1] == 'kept':
    assert keep_freed_memory() and keep_freed_memory()
for step in range(12):
    if step == 2:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    np.ones(2 ** 24, np.float32)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='needs glibc')
def test_blocks_that_are_freed_and_taken_again_fault_no_pages_once_freed_memory_is_kept():
    mapped, kept = (int(subprocess.run([sys.executable, '-c', COUNT, how], check=True, text=True,
                                       stdout=subprocess.PIPE).stdout)
                    for how in ('mapped', 'kept'))
    assert kept < min(100, mapped)
