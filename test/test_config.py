"""Configurations: frozen, read from what was written, and refused where they make nothing."""

from dataclasses import FrozenInstanceError
import json

from active_recon.config import LossConfig, RewardConfig, with_current_keys
from active_recon.errors import ConfigError
from active_recon.models.network_2d3d import Network2d3dConfig
from active_recon.training.supervised import TrainingConfig
import pytest

CONFIGS = [Network2d3dConfig(stem_channels=8, decoder_channels=(4, 2)),
           LossConfig(volume_loss='bce'), RewardConfig(paper_distance=True),
           TrainingConfig(steps=7, bfloat16=False)]


@pytest.mark.parametrize('config', CONFIGS, ids=lambda config: type(config).__name__)
def test_what_is_written_as_json_is_read_back_the_same(config):
    written = json.loads(json.dumps(config.to_dict()))
    assert type(config).from_dict(written) == config


@pytest.mark.parametrize('config', CONFIGS, ids=lambda config: type(config).__name__)
def test_a_configuration_cannot_be_changed(config):
    with pytest.raises(FrozenInstanceError):
        setattr(config, next(iter(config.to_dict())), 1)


def test_unknown_keys_are_named_beside_the_known_ones():
    with pytest.raises(ConfigError, match='Config: unknown key depth, width; .*stem_chan'):
        Network2d3dConfig.from_dict({'width': 3, 'depth': 2, 'stem_channels': 8})


@pytest.mark.parametrize(('kind', 'values'), [
    (Network2d3dConfig, {'stem_channels': 0}), (Network2d3dConfig, {'block_channels': (8, -1, 8)}),
    (LossConfig, {'volume_weight': -0.1}), (LossConfig, {'volume_loss': 'mae'}),
    (LossConfig, {'volume_weight': 0.0, 'silhouette_weight': 0.0}),
    (RewardConfig, {'distance_tau': 0.0}), (RewardConfig, {'policy_sigma': -1.0}),
    (RewardConfig, {'distance_weight': -1.0}), (RewardConfig, {'group_size': 0}),
    (Network2d3dConfig, {'view_separation': -0.1}), (Network2d3dConfig, {'view_separation': 3.2}),
    (TrainingConfig, {'steps': 0}), (TrainingConfig, {'steps': 1, 'learning_rate': 0.0}),
    (TrainingConfig, {'steps': 1, 'batch_size': 0}),
])
def test_what_makes_or_trains_nothing_is_refused(kind, values):
    with pytest.raises(ConfigError, match=f'{kind.__name__}: .+: expected .* got'):
        kind(**values)


def test_the_losses_are_weighted_as_in_the_paper_by_default():
    assert (LossConfig().volume_weight, LossConfig().silhouette_weight) == (0.4, 0.6)
    assert LossConfig().volume_loss == 'mse'


def test_saved_settings_get_the_keys_that_were_renamed_since():
    saved = {'training': {'steps': 3, 'varied': False, 'short_share': 0.2, 'warm_up': 7},
             'reward': {'episodes_alike': 6}, 'threshold': 0.4}
    current = with_current_keys(saved)
    assert TrainingConfig.from_dict(current['training']) == TrainingConfig(
        3, augment=False, curriculum_fraction=0.2, warmup_steps=7)
    assert RewardConfig.from_dict(current['reward']) == RewardConfig(group_size=6)
    assert with_current_keys(current) == current
