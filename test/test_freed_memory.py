"""What a start has used and freed goes back to the system."""

import platform
import subprocess
import sys

import pytest

HELD = """
import ctypes
from active_recon.nodes.runtime.freed_memory import give_back_freed_memory
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
    freed = int(subprocess.run([sys.executable, '-c', HELD], check=True, text=True,
                               stdout=subprocess.PIPE).stdout)
    assert freed > 16_000_000
