"""Timing of reconstructions in fresh processes, for table 4 and figure 10."""

import json
import os
import subprocess
import sys
import tempfile
from typing import Any

from active_recon.errors import DataError
from active_recon.evaluation.statistics import Interval, mean_interval
from active_recon.paper.study import Study
import numpy as np

RUNS = 12
_BUDGET_S = 120


def timed_runs(study: Study) -> list[dict[str, Any]]:
    """
    Time a reconstruction in each of RUNS fresh processes, each of another test object.

    A first run, which fills the disk cache, is not counted. Raises DataError where one fails.
    """
    folders = study.objects('test').folders()
    found = []
    with study.progress('fresh processes', RUNS + 1) as advance, \
            tempfile.TemporaryDirectory() as out:
        for index in range(RUNS + 1):
            folder = folders[index * len(folders) // (RUNS + 1)]
            ended = subprocess.run(
                [sys.executable, '-m', 'active_recon.paper.one_reconstruction', folder.root,
                 folder.category, folder.name, study.weights, str(study.threads),
                 str(study.views), out],
                capture_output=True, text=True, timeout=_BUDGET_S, check=False,
                env=os.environ | {'PYTHONPATH': os.pathsep.join(filter(None, sys.path))})
            if ended.returncode:
                raise DataError(f'{study.weights}: reconstruction failed: expected one of '
                                f'{folder.name}, got: {ended.stderr.strip()[-400:]}')
            found.append(json.loads(ended.stdout))
            advance(1, '')
    return found[1:]


def over_runs(values: list[float]) -> Interval:
    """Return the mean over runs and its 95 % interval, by bootstrap over runs."""
    return mean_interval(np.array(values))
