"""What the nodes touch outside of ROS: the sockets they listen on, and what they write."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import hashlib
import os
from pathlib import Path
import re
import shutil
import socket
import struct
import subprocess
import sys

import active_recon
import pytest
from sensor_msgs.msg import PointCloud2

from .conftest import BUDGET_S, LATCHED_QOS
from .processes import ROOT

pytestmark = pytest.mark.ros
LISTENS = '0A'
# Runs a node, and notes each file or folder that it opens for writing, makes, moves or removes.
WITNESS = """
import os, runpy, sys
notes = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
CHANGES = {'os.mkdir', 'os.rename', 'os.remove', 'os.rmdir', 'os.link', 'os.symlink',
           'os.truncate', 'shutil.copyfile', 'shutil.move', 'shutil.rmtree'}

def note(event, details):
    if event == 'open' and isinstance(details[0], (str, bytes)):
        path, mode, flags = details
        if (set(mode or '') & set('wax+')) or (
                isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)):
            os.write(notes, os.fsencode(os.path.abspath(os.fsdecode(path))) + b'\\n')
    elif event in CHANGES:
        for path in details:
            if isinstance(path, (str, bytes, os.PathLike)):
                os.write(notes, os.fsencode(os.path.abspath(os.fsdecode(path))) + b'\\n')

sys.addaudithook(note)
module, sys.argv = sys.argv[2], sys.argv[2:]
runpy.run_module(module, run_name='__main__')
"""


def listening(pid):
    """Return the TCP addresses on which a process listens."""
    sockets = set()
    for descriptor in os.listdir(f'/proc/{pid}/fd'):
        with suppress(FileNotFoundError):  # closed meanwhile
            if match := re.fullmatch(
                    r'socket:\[(\d+)\]', os.readlink(f'/proc/{pid}/fd/{descriptor}')):
                sockets.add(match[1])
    found = set()
    for family, table in ((socket.AF_INET, 'tcp'), (socket.AF_INET6, 'tcp6')):
        for line in Path(f'/proc/{pid}/net/{table}').read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == LISTENS and words[9] in sockets:
                address, port = words[1].split(':')
                packed = b''.join(struct.pack('=I', int(address[i:i + 8], 16))
                                  for i in range(0, len(address), 8))
                found.add((socket.inet_ntop(family, packed), int(port, 16)))
    return found


def test_no_node_listens_on_tcp_but_the_viewer_on_this_machine_alone(start_node, box, tmp_path):
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    nodes = {name: start_node(name, **parameters) for name, parameters in {
        'viewer': {'port': port}, 'recorder': {'output_dir': tmp_path},
        'turntable_camera': {'mesh': box}, 'reconstructor': {'output_dir': tmp_path},
        'view_planner': {'policy': 'farthest'}}.items()}
    line, = nodes['viewer'].log('the page is at')
    told = int(re.search(r'http://127\.0\.0\.1:(\d+)', line)[1])
    assert listening(nodes.pop('viewer').pid) == {('127.0.0.1', told)}
    assert {name: listening(node.pid) for name, node in nodes.items()} == {
        name: set() for name in nodes}


def test_a_socket_that_listens_is_noticed():
    with socket.create_server(('127.0.0.1', 0)) as server:
        assert server.getsockname() in listening(os.getpid())
    with socket.create_server(('::1', 0), family=socket.AF_INET6) as server:
        assert server.getsockname()[:2] in listening(os.getpid())


@contextmanager
def witnessed(name: str, folder: Path, **parameters) -> Iterator[Path]:
    """Run a node while the block lasts; yield the file that tells what it wrote."""
    notes, log = folder / f'{name}.notes', folder / f'{name}.log'
    arguments = [word for key, value in parameters.items() for word in ('-p', f'{key}:={value}')]
    with log.open('w') as output:
        process = subprocess.Popen(
            [sys.executable, '-c', WITNESS, notes, f'active_recon.nodes.{name}', '--ros-args',
             *arguments], cwd=folder, stdout=output, stderr=output,
            env={**os.environ, 'PYTHONPATH': str(ROOT), 'PYTHONDONTWRITEBYTECODE': '1'})
    try:
        yield notes
    finally:
        process.terminate()
        code = process.wait(BUDGET_S)
    assert code == 0, log.read_text()


def fingerprints(folder):
    return {path: (hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns)
            for path in folder.rglob('*') if path.is_file()}


def test_files_that_parameters_name_are_only_read_and_all_else_goes_under_output_dir(
        ros_domain, bench, tmp_path, box):
    given, out, run = tmp_path / 'given', tmp_path / 'out', tmp_path / 'run'
    for folder in (given, run):
        folder.mkdir()
    for path in (Path(active_recon.__file__).parent / 'weights').glob('2d3d-attention.*'):
        shutil.copy(path, given)
    mesh = Path(shutil.copy(box, given))
    before = fingerprints(given)
    with (witnessed('recorder', run, output_dir=out / 'bags') as by_recorder,
          witnessed('turntable_camera', run, mesh=mesh) as by_camera,
          witnessed('reconstructor', run, weights=given / '2d3d-attention.safetensors',
                    take_views='all', threshold=0.01, output_dir=out / 'meshes') as by_network):
        occupancy = bench.subscribe(PointCloud2, 'occupancy', LATCHED_QOS)
        bench.until(lambda: occupancy, 'a view of what the camera shows', 3 * BUDGET_S)
        mesh_file = Path(bench.call('save_mesh').message)
        bag = Path(bench.call('stop').message)
    assert fingerprints(given) == before
    assert mesh_file.parent == out / 'meshes'
    assert bag.parent == out / 'bags'
    allowed = (out, Path(os.environ['ROS_LOG_DIR']), Path('/dev'))
    for notes in (by_recorder, by_camera, by_network):
        written = {Path(line) for line in notes.read_text().splitlines()}
        outside = {path for path in written
                   if not any(path.is_relative_to(folder) for folder in allowed)}
        assert not outside
    assert any(path.endswith('.mcap') for path in by_recorder.read_text().splitlines())
    left = {path.name for path in run.iterdir()}
    assert left == {f'{name}.{kind}' for name in ('recorder', 'turntable_camera', 'reconstructor')
                    for kind in ('notes', 'log')}
