"""Training on two processes: one set of weights, and the loss curve of one process."""

import os
from pathlib import Path
import socket
import subprocess
import sys
import time

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


def on_two_nodes(dataset, out, *more):
    """Start the command once for each of two nodes on the loopback; return the two processes."""
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    return [subprocess.Popen(
        [sys.executable, '-m', 'active_recon.cli.main', 'train', dataset, '--validation', dataset,
         '--out', out, '--threads', '1', '--nodes', '2', '--model', '2d3d', '--batch-size', '4',
         '--checkpoint-every', '1', *more],
        env=os.environ | {'OMP_NUM_THREADS': '1', 'PYTHONPATH': str(ROOT),
                          'MASTER_ADDR': '127.0.0.1', 'MASTER_PORT': str(port),
                          'NODE_RANK': str(rank), 'GLOO_SOCKET_IFNAME': 'lo'},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) for rank in range(2)]


@pytest.mark.slow
def test_two_nodes_train_as_two_processes_do_and_go_on_after_one_died(dataset, tmp_path):
    train(dataset, tmp_path / 'processes', 2, 12, '--batch-size', '4')
    out = tmp_path / 'nodes'
    both = on_two_nodes(dataset, out, '--steps', '12')
    checkpoint, end = out / 'reconstruction.safetensors', time.monotonic() + 300
    while not checkpoint.exists() and time.monotonic() < end:
        time.sleep(0.02)
    for process in reversed(both):  # one dies, and its launcher ends the other
        process.kill()
        process.communicate()
    assert checkpoint.exists() and not (out / 'weights.safetensors').exists()
    told = [process.communicate(timeout=600)[0]
            for process in on_two_nodes(dataset, out, '--steps', '12', '--resume')]
    assert sum(text.count('wrote ') for text in told) == 1, told
    expected, found = (load_file(folder / 'weights.safetensors')
                       for folder in (tmp_path / 'processes', out))
    assert expected.keys() == found.keys()
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, atol=1e-4)
