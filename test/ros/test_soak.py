"""The loop over a long time, as `make soak` runs it for an hour: here for seconds or minutes."""

import json
import os
import subprocess
import sys

import pytest

from .processes import ROOT

pytestmark = pytest.mark.ros
LONG = pytest.param(2, marks=pytest.mark.slow)


@pytest.fixture(scope='module')
def soaked(request, tmp_path_factory):
    """Return what was measured in so many minutes."""
    folder = tmp_path_factory.mktemp('soak')
    done = subprocess.run(
        [sys.executable, '-m', 'benchmarks.soak', '--minutes', str(request.param), '--output-dir',
         folder],
        cwd=ROOT, env={**os.environ, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True)
    assert (folder / 'soak.json').is_file(), done.stderr
    assert done.stdout.strip() == (folder / 'soak.md').read_text().strip()
    return json.loads((folder / 'soak.json').read_text())


@pytest.mark.parametrize('soaked', [pytest.param(0.25, marks=pytest.mark.slow), LONG],
                         indirect=True)
def test_every_episode_of_a_long_run_is_whole_and_recorded(soaked):
    assert not soaked['broken_by']
    assert soaked['episodes'] >= 1
    assert soaked['whole'] == soaked['episodes']
    assert soaked['recorded_views'] >= soaked['views'] == 5 * soaked['whole']


@pytest.mark.parametrize('soaked', [LONG], indirect=True)
def test_memory_is_flat_once_the_loop_is_warm(soaked):
    growth = {name: use['growth_mb'] for name, use in soaked['memory'].items()}
    assert set(growth) == {'recorder', 'turntable_camera', 'reconstructor', 'view_planner'}
    assert growth['reconstructor'] < 5, growth
    assert all(each < 10 for each in growth.values()), growth
