"""What the paper's parts measure of episodes."""

from dataclasses import replace

from active_recon.config import LossConfig
from active_recon.paper import measured
from active_recon.paper.measured import measure_loss
from active_recon.paper.study import Study
import numpy as np
from paper_study import untrained
import pytest


@pytest.mark.slow
def test_the_loss_of_an_episode_does_not_depend_on_how_many_are_measured_at_once(
        dataset, tiny, tmp_path, monkeypatch):
    (tmp_path / 'data').mkdir()
    (tmp_path / 'data' / 'test').symlink_to(dataset)
    weights = untrained(tmp_path / 'weights', tiny, 0)
    study = Study(tmp_path / 'data', tmp_path / 'one', starts=1, views=2, threads=1)
    monkeypatch.setattr(measured, '_BATCH', 1)
    one, all_at_once = [], []
    for found, models in ((one, 'one'), (all_at_once, 'all')):
        found.append(measure_loss(replace(study, models=tmp_path / models), weights, 'random',
                                  study.objects('test'), LossConfig()))
        monkeypatch.undo()
    np.testing.assert_allclose(one[0], all_at_once[0], rtol=1e-4)
    assert one[0].shape == (6, 1, 2)
