"""The demo with its page: what a person sees live, late and twice, and can ask for."""

import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from active_recon.launching.processes import private_environment
from active_recon.viewer.address import is_served
import pytest

pytestmark = [pytest.mark.browser, pytest.mark.ros]
ROOT = Path(__file__).parents[2]
BUDGET_S = 120.0
_LOOP = """
/**/turntable_camera: {ros__parameters: {mesh: chair, object_size: 0.16, speed: 3.0}}
/**/reconstructor: {ros__parameters: {object_size: 0.16, take_views: at_goal}}
/**/view_planner: {ros__parameters: {object_size: 0.16, policy: farthest, max_views: 2,
                                 entropy_tolerance: 0.0}}
"""
_CLICK = """
[...document.querySelectorAll('button')].find((one) => one.innerText === arguments[0]).click()
"""


_SMALL = (640, 480)  # fast to draw without a graphics card


class Command:
    """A command of ours in a process of its own, and what it has said."""

    def __init__(self, folder, *words, **environment):
        folder.mkdir()
        self._said = folder / 'said.txt'
        with self._said.open('w') as said:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'active_recon.cli.main', *words], cwd=folder, stdout=said,
                stderr=subprocess.STDOUT,
                env={**os.environ, 'PYTHONPATH': str(ROOT), 'PYTHONUNBUFFERED': '1',
                     'OMP_NUM_THREADS': '1', 'COLUMNS': '200', **environment})

    def said(self, pattern):
        """Wait until it has said what fits; return the first group."""
        deadline = time.monotonic() + BUDGET_S
        while not (found := re.search(pattern, self._said.read_text())):
            assert self._process.poll() is None, f'ended: {self._said.read_text()}'
            assert time.monotonic() < deadline, f'no {pattern!r}: {self._said.read_text()}'
            time.sleep(0.05)
        return found[1]

    def interrupt(self):
        """Press Ctrl-C; return the exit code and all that was said."""
        self._process.send_signal(signal.SIGINT)
        return self._process.wait(BUDGET_S), self._said.read_text()

    def kill(self):
        if self._process.poll() is None:
            self.interrupt()


def episode(words):
    """Return the id of the episode that the page tells, '' where it tells none."""
    found = re.search(r'Episode (\w+)\.', words)
    return found[1] if found else ''


@pytest.fixture(scope='module')
def demo(tmp_path_factory):
    command = Command(tmp_path_factory.mktemp('demo') / 'run', 'demo', '--view', '--views', '2')
    yield command
    command.kill()


@pytest.fixture
def late_view(demo, tmp_path):
    """Return a second viewer, started when the loop has come to rest."""
    demo.said('(run until Ctrl-C)')
    command = Command(
        tmp_path / 'view', 'view', ROS_DOMAIN_ID=demo.said(r'domain\s+(\d+)'),
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        FASTRTPS_DEFAULT_PROFILES_FILE=str(ROOT / 'active_recon' / 'nodes' / 'fastdds_local.xml'))
    yield command
    command.kill()


def test_the_page_follows_the_loop_and_begins_a_new_episode_when_asked(demo, chromium):
    url = demo.said(r'the page is at (http://127\.0\.0\.1:\d+)')
    chromium.open(url, _SMALL)
    chromium.until(lambda: 'Done (max views): 2 views' in chromium.text(), 'the end', BUDGET_S)
    demo.said('(run until Ctrl-C)')
    first = episode(chromium.text())
    chromium.run(_CLICK, 'New episode')
    chromium.until(lambda: episode(chromium.text()) not in ('', first), 'another', BUDGET_S)
    chromium.until(lambda: 'Done (max views): 2 views' in chromium.text(), 'its end', BUDGET_S)
    chromium.run(_CLICK, 'Skip goal')
    chromium.until(lambda: 'no goal to skip: expected an open one' in chromium.text(), 'no goal')
    chromium.run(_CLICK, 'Save mesh')
    chromium.until(lambda: re.search(r'\w+-2\.ply', chromium.text()), 'the mesh', BUDGET_S)
    assert not chromium.errors()


@pytest.mark.slow
def test_who_comes_late_is_shown_what_is_latched_at_another_port(demo, late_view, chromium):
    first = demo.said(r'the page is at (http://127\.0\.0\.1:\d+)')
    url = late_view.said(r'the page is at (http://127\.0\.0\.1:\d+)')
    assert url != first
    chromium.open(url, _SMALL)
    chromium.until(lambda: 'Done (max views): 2 views, the last' in chromium.text(),
                   'the latched view', BUDGET_S)
    code, said = late_view.interrupt()
    assert code == 0
    assert 'Traceback' not in said
    assert not is_served(int(url.rpartition(':')[2]))


@pytest.fixture
def small_loop(tmp_path):
    """Return a loop of a small object in a namespace, whose topics have other names."""
    environment = private_environment()
    (tmp_path / 'loop.yaml').write_text(_LOOP)
    command = Command(tmp_path / 'up', 'up', '--params', str(tmp_path / 'loop.yaml'),
                      '--namespace', 'cell_1', '-r', 'camera/image_raw:=usb_cam/image',
                      '-r', 'view:=seen', **environment)
    yield environment
    command.kill()


@pytest.mark.slow
def test_a_loop_of_other_size_and_names_is_shown_without_being_told(
        small_loop, tmp_path, chromium):
    command = Command(tmp_path / 'view', 'view', '--port', '0', **small_loop)
    try:
        chromium.open(command.said(r'the page is at (http://127\.0\.0\.1:\d+)'), _SMALL)
        chromium.until(lambda: 'Done (max views)' in chromium.text(), 'the views', BUDGET_S)
        assert 'No publisher' not in chromium.text()
        assert not chromium.errors()
    finally:
        command.kill()


def test_ctrl_c_ends_the_demo_its_nodes_and_its_page(demo):
    demo.said('(run until Ctrl-C)')
    port = int(demo.said(r'the page is at http://127\.0\.0\.1:(\d+)'))
    assert is_served(port)
    code, said = demo.interrupt()
    assert code == 0
    assert 'the bag, the mesh and the picture are in' in said
    assert 'Traceback' not in said
    assert not is_served(port)
