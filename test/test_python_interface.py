"""What `import active_recon` offers: little at once, the rest when it is asked for."""

import doctest
import subprocess
import sys

import active_recon
import pytest


def test_the_example_of_the_package_runs():
    failed, tried = doctest.testmod(active_recon)
    assert tried and not failed


@pytest.mark.parametrize('name', active_recon.__all__)
def test_what_is_offered_is_there(name):
    assert getattr(active_recon, name).__name__ == name
    assert name in dir(active_recon)


def test_the_package_alone_brings_neither_torch_nor_numpy():
    asked = subprocess.run(
        [sys.executable, '-c',
         'import sys, active_recon; print({"torch", "numpy"} & {*sys.modules})'],
        capture_output=True, text=True, check=True)
    assert asked.stdout.strip() == 'set()'
    named = 'from active_recon import Camera, load, Planner, Reconstructor, VoxelGrid'
    asked = subprocess.run(
        [sys.executable, '-c', f'import sys; {named}; print("torch" in sys.modules)'],
        capture_output=True, text=True, check=True)
    assert asked.stdout.strip() == 'False'


def test_what_is_not_there_is_refused():
    with pytest.raises(AttributeError, match="'active_recon' has no attribute 'Scanner'"):
        active_recon.Scanner  # noqa: B018
