"""Two thousand damaged bags, each read or refused: no crash, no hang, no memory run wild."""

from collections import Counter
from contextlib import contextmanager
import resource
import signal

from active_recon.bags.runs.reading import read_run
from active_recon.errors import ActiveReconError
from foreign_recordings import cameras, images, joints, png
from loop_bags import DELAY, LoopRun, type_name, write_bag
from mcap.writer import CompressionType, Writer
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recorded_messages import definition
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from test_reading import copied

SECONDS_EACH = 10
MEMORY_MIB = 300
LARGE = (2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)
RECORDINGS = (
    LoopRun(azimuths=(0.0, 2.0)).messages,
    images(make=png) + joints(),
    [*images(), *cameras()],
)


class HangError(BaseException):
    """What no one catches on the way: a bag took too much of a core."""


@contextmanager
def at_most(seconds):
    """Raise HangError once the block has had so much of a core, however busy the machine is."""
    def stop(*_):
        raise HangError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def damaged(content, rng):
    """Return bytes with a few damages: bits, numbers, and pieces lost, doubled or moved."""
    content = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(content) + 1))
        length = int(rng.integers(1, 40))
        match rng.integers(7):
            case 0 if at < len(content):
                content[at] ^= 1 << rng.integers(8)
            case 1:
                content[at:at + length] = rng.bytes(min(length, 8))
            case 2:
                size = int(rng.choice([4, 8]))
                number = LARGE[rng.integers(len(LARGE))] % 2**(8 * size)
                content[at:at + size] = number.to_bytes(size, 'little')
            case 3:
                del content[at:at + length]
            case 4:
                content[at:at] = content[at - length:at]
            case 5:
                source = int(rng.integers(len(content) + 1))
                content[at:at + length] = content[source:source + length]
            case 6 if rng.random() < 0.3:
                del content[at:]
    return bytes(content)


def rewritten(path, messages, rng):
    """Write a whole MCAP file in which the messages or their definitions are damaged."""
    messages = sorted(messages, key=lambda entry: entry[0])
    victim = rng.integers(len(messages))
    lies = rng.random() < 0.2
    with path.open('wb') as file:
        writer = Writer(file, compression=list(CompressionType)[rng.integers(3)],
                        use_chunking=bool(rng.random() < 0.8))
        writer.start('ros2', 'fuzz')
        if rng.random() < 0.2:
            writer.add_attachment(0, 0, 'parameters/reconstructor.yaml', 'application/yaml',
                                  damaged(b'object_size: 1.0\nmax_pose_gap: 0.1\n', rng))
        channels = {}
        for number, (time, topic, msg) in enumerate(messages):
            if topic not in channels:
                text = definition(type_name(msg)).encode()
                schema = writer.register_schema(type_name(msg), 'ros2msg', (
                    damaged(text, rng) if lies and rng.random() < 0.3 else text))
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            data = serialize_message(msg)
            writer.add_message(channels[topic], time + DELAY,
                               damaged(data, rng) if number == victim and not lies else data,
                               time)
        writer.finish()


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return bags of each recording: a folder, a bare file, a database, and one of each packed."""
    folder = tmp_path_factory.mktemp('whole')
    bags = [write_bag(folder / f'run{number}', sorted(messages, key=lambda entry: entry[0]))
            for number, messages in enumerate(RECORDINGS)]
    return [*bags, *(bag / f'{bag.name}_0.mcap' for bag in bags),
            *(copied(bag, folder / f'{bag.name}_sqlite', StoragePlugin.SQLITE3) for bag in bags),
            *(copied(bags[0], folder / f'packed_{storage.name}_{mode.name}', storage, mode)
              for storage in StoragePlugin
              for mode in (CompressionMode.FILE, CompressionMode.MESSAGE))]


def mutated(path, whole, rng):
    """Leave a damaged bag at the path, and return where it is."""
    if rng.random() < 0.5:
        path = path.with_suffix('.mcap')
        rewritten(path, RECORDINGS[rng.integers(len(RECORDINGS))], rng)
        return path
    source = whole[rng.integers(len(whole))]
    if source.is_file():
        path = path.with_suffix(source.suffix)
        path.write_bytes(damaged(source.read_bytes(), rng))
        return path
    path.mkdir()
    files = sorted(source.iterdir())
    victim = files[rng.integers(len(files))]
    for file in files:
        content = file.read_bytes()
        (path / file.name).write_bytes(damaged(content, rng) if file == victim else content)
    return path


def memory_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@pytest.mark.parametrize('count', [200, pytest.param(2000, marks=pytest.mark.slow)])
def test_every_damaged_bag_is_read_or_refused(tmp_path, whole, count):
    outcomes = Counter()
    before = memory_mib()
    for seed in range(count):
        path = mutated(tmp_path / f'bag{seed}', whole, np.random.default_rng(seed))
        try:
            with at_most(SECONDS_EACH):
                read_run(path)
            outcomes['read'] += 1
        except ActiveReconError as error:
            assert '\n' not in str(error) and str(path) in str(error), seed
            outcomes[f'refused: {error.kind}'] += 1
        except BaseException as error:
            raise AssertionError(f'seed {seed}, {path}: {error!r}') from error
    assert memory_mib() - before < MEMORY_MIB
    assert outcomes['read'] > count / 20, outcomes
    assert len(outcomes) > 5, outcomes
