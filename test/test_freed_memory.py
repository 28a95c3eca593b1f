"""What has been used and freed goes back to the system."""

import platform
import subprocess
import sys

import pytest

KEPT = """
import numpy as np
from active_recon.freed_memory import give_back_freed_memory
from active_recon.training.allocation import keep_freed_memory
def held():
    return int(open('/proc/self/statm').read().split()[1]) * 4096
keep_freed_memory()
blocks = [np.ones(2 ** 18) for _ in range(40)]
last = np.ones(2 ** 18)
del blocks
before = held()
give_back_freed_memory()
print(before - held())
"""
HELD = """
import ctypes
from active_recon.freed_memory import give_back_freed_memory
def held():
    return int(open('/proc/self/statm').read().split()[1]) * 4096
blocks = [ctypes.create_string_buffer(b'x' * 4000) for _ in range(8000)]
last = ctypes.create_string_buffer(b'x' * 4000)  # the heap cannot shrink below it
del blocks
before = held()
give_back_freed_memory()
print(before - held())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='needs glibc')
def test_freed_blocks_below_a_block_in_use_go_back_to_the_system():
    assert freed_by(HELD) > 16_000_000


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='needs glibc')
def test_what_a_training_keeps_goes_back_too():
    assert freed_by(KEPT) > 60_000_000


def freed_by(program):
    return int(subprocess.run([sys.executable, '-c', program], check=True, text=True,
                              stdout=subprocess.PIPE).stdout)
