"""Training on two processes: one set of weights, and the loss curve of one process."""

from contextlib import suppress
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
import time

from active_recon.datasets.making import make_object, shape_jobs
from active_recon.models.weights import load_weights
import numpy as np
import pytest
from safetensors.numpy import load_file
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

ROOT = Path(__file__).parents[1]


def train(dataset, out, devices, steps, *more):
    """Train by the command, in a process of its own; return the losses, step by step."""
    environment = os.environ | {'OMP_NUM_THREADS': '1', 'PYTHONPATH': str(ROOT)}
    done = subprocess.run(
        [sys.executable, '-m', 'active_recon.cli.main', 'train', dataset, '--validation', dataset,
         '--out', out, '--steps', str(steps), '--threads', '1', '--devices', str(devices),
         '--model', '2d3d', *more],
        env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    events = EventAccumulator(str(out / 'tensorboard' / 'reconstruction'))
    events.Reload()
    return np.array([event.value for event in events.Scalars('reconstruction/loss')]), done


@pytest.mark.slow
def test_two_processes_write_one_set_of_weights_and_one_log(dataset, tmp_path):
    losses, done = train(dataset, tmp_path / 'run', 2, 2, '--batch-size', '4')
    assert len(losses) == 2
    assert np.isfinite(losses).all()
    assert done.stdout.count('wrote ') == 1
    assert load_weights(tmp_path / 'run' / 'weights.safetensors').model == '2d3d'


@pytest.mark.slow
def test_one_of_two_processes_calibrates_and_chooses_the_threshold(tmp_path):
    data = tmp_path / 'data'
    for job in shape_jobs('lamp', range(4), data):
        assert not make_object(job, samples=1, fine=True).refusal
    losses, done = train(data, tmp_path / 'run', 2, 2, '--batch-size', '4', '--model', 'lifting',
                         '--max-views', '2')
    assert np.isfinite(losses).all()
    assert done.stdout.count('calibration: 4/4') == done.stdout.count('threshold 0.') == 1
    calibration = load_weights(tmp_path / 'run' / 'weights.safetensors').reconstruction.calibration
    assert not np.allclose(calibration[0], [1, 0, 0])


@pytest.mark.slow
def test_a_batch_that_cannot_be_shared_is_refused(dataset, tmp_path):
    with pytest.raises(AssertionError, match='batch_size: not divisible: expected a multiple of '
                       'the 2 processes'):
        train(dataset, tmp_path / 'run', 2, 1, '--batch-size', '3')


@pytest.mark.slow
def test_two_processes_give_the_loss_curve_of_one_within_noise(dataset, tmp_path):
    def curve(name, devices, seed):
        losses, _ = train(dataset, tmp_path / name, devices, 60, '--batch-size', '8', '--seed',
                          str(seed))
        return losses.reshape(6, 10).mean(axis=1)  # means of ten steps

    alone = np.stack([curve(f'one-{seed}', 1, seed) for seed in range(4)])
    together = np.stack([curve(f'two-{seed}', 2, seed) for seed in range(4)])
    error = np.sqrt((alone.var(axis=0, ddof=1) + together.var(axis=0, ddof=1)) / 4)
    assert (np.abs(alone.mean(axis=0) - together.mean(axis=0)) < 4 * error).all()
    assert (together[:, -1] < together[:, 0]).all()  # and it is a curve that falls


def train_words(dataset, out, *more):
    return ['-m', 'active_recon.cli.main', 'train', dataset, '--validation', dataset, '--out', out,
            '--threads', '1', '--nodes', '2', '--model', '2d3d', '--batch-size', '4',
            '--checkpoint-every', '1', *more]


def on_two_nodes(by_torchrun, *words):
    """Start what two nodes on the loopback start, by hand or by torchrun; return both."""
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = str(free.getsockname()[1])
    launcher = ['-m', 'torch.distributed.run', '--nnodes', '2', '--nproc-per-node', '1',
                '--rdzv-backend', 'c10d', '--rdzv-endpoint', f'127.0.0.1:{port}',
                '--local-addr', '127.0.0.1'] if by_torchrun else []
    common = {'OMP_NUM_THREADS': '1', 'PYTHONPATH': str(ROOT), 'GLOO_SOCKET_IFNAME': 'lo'}
    return [subprocess.Popen(
        [sys.executable, *launcher, *words],
        env=os.environ | common | ({} if by_torchrun else {
            'MASTER_ADDR': '127.0.0.1', 'MASTER_PORT': port, 'NODE_RANK': str(rank)}),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
        for rank in range(2)]


def kill_node(process):
    """Kill a node with all that runs on it: torchrun gives its workers sessions of their own."""
    with suppress(ProcessLookupError, FileNotFoundError):
        workers = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
        for session in (process.pid, *map(int, workers)):
            with suppress(ProcessLookupError):
                os.killpg(session, signal.SIGKILL)


@pytest.fixture(scope='module')
def undisturbed(dataset, tmp_path_factory):
    """Return the weights of two processes that trained to the end."""
    out = tmp_path_factory.mktemp('undisturbed')
    train(dataset, out, 2, 12, '--batch-size', '4')
    return load_file(out / 'weights.safetensors')


@pytest.mark.slow
@pytest.mark.parametrize('by_torchrun', [False, True])
def test_two_nodes_train_as_two_processes_do_and_go_on_after_one_died(
        by_torchrun, dataset, undisturbed, tmp_path):
    out = tmp_path / 'nodes'
    words = train_words(dataset, out, '--steps', '12', '--resume')
    first, second = on_two_nodes(by_torchrun, *words)
    checkpoint, end = out / 'reconstruction.safetensors', time.monotonic() + 300
    try:
        while not checkpoint.exists() and time.monotonic() < end:
            time.sleep(0.02)
        kill_node(second)
        # The other does not go on alone; it may wait for torch's 30 minutes for a collective
        first.communicate(timeout=2000)
    finally:
        for process in (first, second):
            kill_node(process)
            process.communicate()
    assert first.returncode != 0
    assert checkpoint.exists() and not (out / 'weights.safetensors').exists()
    told = [process.communicate(timeout=600)[0] for process in on_two_nodes(by_torchrun, *words)]
    assert sum(text.count('wrote ') for text in told) == 1, told
    found = load_file(out / 'weights.safetensors')
    assert undisturbed.keys() == found.keys()
    for name, value in undisturbed.items():
        np.testing.assert_allclose(found[name], value, atol=1e-4)
