"""A writer killed at any moment: what it had brought to the disk is there, and can be repaired."""

import os
from pathlib import Path
import random
import subprocess
import sys
import time

from active_recon.bags.storage.repair import repair_bag
from active_recon.bags.storage.salvage import Salvage
import endless_recording
from mcap.records import Message
import pytest
from recorded_messages import errors_in
from rosbags.rosbag2 import Reader

ROOT = Path(__file__).parents[1]
KILLS, IN_EVERY_RUN = 50, 5


def kill_a_writer(folder, seed):
    """Kill a process that records into a folder; return how many messages it had acknowledged."""
    process = subprocess.Popen(
        [sys.executable, endless_recording.__file__, str(folder), str(seed)],
        stdout=subprocess.PIPE, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    rng = random.Random(seed)
    deadline = time.monotonic() + 60
    while not folder.exists():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.001)
    time.sleep(rng.choice((0.01, 0.1, 0.5)) * rng.random())
    process.kill()
    acknowledged = process.communicate()[0].split(b'\n')[:-1]
    return int(acknowledged[-1]) if acknowledged else 0


def number(file):
    return int(file.stem.split('_')[-1])


def read_scanning(folder):
    """Return all messages of the files as they are, in their order."""
    return [record.data for file in sorted(folder.glob('*.mcap'), key=number)
            for record in Salvage(file).records() if isinstance(record, Message)]


@pytest.mark.parametrize('seed', [
    pytest.param(seed, marks=[pytest.mark.slow] * (seed >= IN_EVERY_RUN))
    for seed in range(KILLS)])
def test_nothing_acknowledged_is_lost_and_the_repaired_bag_is_whole(tmp_path, seed):
    folder = tmp_path / 'run'
    acknowledged = kill_a_writer(folder, seed)
    kept = read_scanning(folder)
    assert len(kept) >= acknowledged
    assert kept == [endless_recording.message(number) for number in range(len(kept))]
    if not any(folder.glob('*.mcap')):  # killed before its first file
        return
    repair_bag(folder)
    with Reader(folder) as reader:
        assert [bytes(data) for _, _, data in reader.messages()] == kept
    cut_off = max(folder.glob('*.mcap'), key=number)
    assert not errors_in(cut_off)
