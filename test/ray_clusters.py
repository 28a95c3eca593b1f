"""A Ray cluster on the loopback: a head without CPUs, and workers of one CPU each."""

from contextlib import contextmanager
import os
from pathlib import Path
import socket
import subprocess
import sys
import time

ROOT = Path(__file__).parents[1]
_HEAD = '127.0.0.2'  # Ray reads 127.0.0.1 as the machine's address to others
_STORE = 80 * 2 ** 20  # bytes of memory shared by the processes of a node


def free_port():
    """Return a port of the loopback that nothing listens at."""
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        return free.getsockname()[1]


@contextmanager
def ray_cluster(workers=2):
    """Yield a cluster whose head and workers are processes of their own, and its address."""
    path = os.environ.get('PYTHONPATH')
    os.environ['RAY_USAGE_STATS_ENABLED'] = '0'
    os.environ['PYTHONPATH'] = os.pathsep.join(
        [str(ROOT), str(ROOT / 'test'), *filter(None, [path])])
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={
        'node_ip_address': _HEAD, 'object_store_memory': _STORE, 'num_cpus': 0,
        'include_dashboard': False})
    try:
        for number in range(workers):
            cluster.add_node(node_ip_address=f'127.0.0.{3 + number}', num_cpus=1,
                             object_store_memory=_STORE)
        yield cluster
    finally:
        cluster.shutdown()
        if path is None:
            del os.environ['PYTHONPATH']
        else:
            os.environ['PYTHONPATH'] = path


@contextmanager
def ray_client_server(cluster):
    """Yield the address at which a process like that of `ray start --head` serves Ray Client."""
    host, port = '127.0.0.1', free_port()
    server = subprocess.Popen(
        [sys.executable, '-m', 'ray.util.client.server', '--address', cluster.address, '--host',
         host, '--port', str(port), '--mode', 'proxy'],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        # without it, the server that Ray forks for each client dies now and then
        env=os.environ | {'GRPC_ENABLE_FORK_SUPPORT': '0'})
    try:
        wait_for_port(host, port)
        yield f'ray://{host}:{port}'
    finally:
        server.terminate()
        server.wait()


def wait_for_port(host, port):
    """Wait until a server listens."""
    end = time.monotonic() + 60
    while True:
        try:
            socket.create_connection((host, port), 1).close()
            return
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)
