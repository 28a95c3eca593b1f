"""Nodes in forks of the process that starts them."""

import json
import os
import subprocess
import sys

import pytest

from .conftest import BUDGET_S
from .processes import ROOT

pytestmark = pytest.mark.ros
# In a process of its own: that of the tests has threads
PROGRAM = """
import json, os, sys, time
from pathlib import Path
from active_recon.launching.processes import NodeError, NodeProcesses, private_environment
import active_recon.nodes.recorder

folder = Path(sys.argv[1])
said = {}
with NodeProcesses(folder, private_environment()) as nodes:
    nodes.fork('recorder', {'output_dir': folder / 'bags 1', 'record_at_start': True})
    nodes.fork('view_planner', {'policy': 'none such'})
    while 'recording into' not in (folder / 'recorder.txt').read_text():
        time.sleep(0.01)
    try:
        while True:
            nodes.check()
            time.sleep(0.01)
    except NodeError as error:
        said['failure'] = str(error)
    process = Path('/proc', str(nodes.pid('recorder')))
    said['name'] = (process / 'comm').read_text().strip()
    said['session'] = os.getsid(nodes.pid('recorder')) == nodes.pid('recorder')
said['ended'] = not process.exists()
said['log'] = (folder / 'recorder.txt').read_text()
print(json.dumps(said))
"""


@pytest.fixture(scope='module')
def said(tmp_path_factory):
    folder = tmp_path_factory.mktemp('logs')
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM, str(folder)], capture_output=True, text=True,
        timeout=BUDGET_S, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout) | {'folder': folder}


def test_a_fork_has_the_parameters_that_it_was_given_and_writes_its_own_log(said):
    bag, = (said['folder'] / 'bags 1').glob('*/*.mcap')
    assert f'[recorder]: recording into {bag.parent}' in said['log']
    assert 'Traceback' not in said['log']


def test_a_fork_ends_when_it_is_stopped_and_completes_its_files(said):
    assert said['ended']
    assert list((said['folder'] / 'bags 1').glob('*/metadata.yaml'))


def test_a_fork_has_the_name_of_its_node_and_no_terminal(said):
    assert (said['name'], said['session']) == ('recorder', True)


def test_a_fork_that_cannot_start_is_told_with_its_last_words(said):
    assert said['failure'].startswith('view_planner ended with code 1. The end of its log:')
    assert 'none such' in said['failure']
