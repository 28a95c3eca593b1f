"""Messages to record, made without ROS, and a checker of MCAP files that we did not write."""

from contextlib import contextmanager
from pathlib import Path
import resource
import subprocess
import sys

from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
import numpy as np
from pymcap_cli.doctor import examine_mcap, Severity
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
HEADER, IMAGE = 'std_msgs/msg/Header', 'sensor_msgs/msg/Image'
LATCHED = QosProfile(durability='transient_local')
SENSOR = QosProfile(reliability='best_effort')


def definition(type_name):
    return STORE.generate_msgdef(type_name, ros_version=2)[0]


def header(number):
    time = STORE.types['builtin_interfaces/msg/Time'](sec=1_700_000_000 + number, nanosec=number)
    return STORE.types[HEADER](stamp=time, frame_id=f'episode {number}')


def image(number, side=8):
    pixels = np.random.default_rng(number).integers(0, 256, side * side * 3, np.uint8)
    return STORE.types[IMAGE](header=header(number), height=side, width=side, encoding='rgb8',
                              is_bigendian=0, step=3 * side, data=pixels)


def cdr(message):
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


def time_of(number):
    return 1_700_000_000_000_000_000 + number * 1_000_000


def announced(folder, max_bytes=None):
    bag = BagWriter(folder, max_bytes)
    bag.add_topic('/episode', HEADER, definition(HEADER), (LATCHED,))
    bag.add_topic('/camera/image_raw', IMAGE, definition(IMAGE), (SENSOR,))
    return bag


def doctor(path):
    program = Path(sys.executable).with_name('pymcap-cli')
    return subprocess.run([program, 'doctor', path], capture_output=True, text=True, timeout=600)


def errors_in(path):
    """Return the errors that the same checker finds, with no process of its own."""
    with path.open('rb') as file:
        report = examine_mcap(file, path.stat().st_size, str(path))
    return [finding.message for finding in report.findings if finding.severity is Severity.ERROR]


@contextmanager
def small_disk(size):
    """Files end at that many bytes here, and say so as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
