"""Six small objects and a network that learns in seconds, for whatever tests the learned core."""

from collections.abc import Iterator
from functools import cache
import gc
import os
from pathlib import Path
import tempfile

from active_recon import reconstructor
from active_recon.datasets.layout import list_objects
from active_recon.datasets.views import read_views, ViewSet
from active_recon.models.attention import AttentionModel
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.network_2d3d import Network2d3d, Network2d3dConfig
import pytest
from small_datasets import lamps_and_tables
import torch

pytest_plugins = ['live_tests']
# Nothing is left in the user's cache; what was compiled in one process serves the others
os.environ.setdefault(
    'ACTIVE_RECON_CACHE', str(Path(tempfile.gettempdir()) / f'active_recon-tests-{os.getuid()}'))


def pytest_configure() -> None:
    """Look for no garbage while thousands of tests are collected: there is none."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Look for garbage among what the tests make alone."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope='session')
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of three lamps and three tables in R2N2's layout."""
    return lamps_and_tables(tmp_path_factory.mktemp('dataset'), 3)


@pytest.fixture(scope='session')
def views(dataset: Path) -> ViewSet:
    """Return the same six objects in memory."""
    return read_views(list_objects(dataset))


@pytest.fixture(scope='session')
def tiny() -> Network2d3dConfig:
    """Return the sizes of a network that is fast, and need not be good."""
    return Network2d3dConfig(
        stem_channels=4, block_channels=(6, 8, 8), recurrent_channels=8, bottleneck_channels=16,
        latent_channels=2, volume_channels=6, decoder_channels=(6, 4), glimpse_channels=8)


@pytest.fixture(scope='module')
def loaded_once() -> Iterator[None]:
    """Load networks once for all reconstructors and commands of a module: they have no state."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ('load_runtime', 'load_depth_runtime'):
            patch.setattr(reconstructor, name, cache(getattr(reconstructor, name)))
        yield


@pytest.fixture
def network(tiny: Network2d3dConfig) -> ReconstructionNetwork:
    """Return a small reconstruction network with the same fresh weights every time."""
    torch.manual_seed(0)
    return Network2d3d.from_config(tiny).eval()


@pytest.fixture
def attention(tiny: Network2d3dConfig) -> AttentionModel:
    """Return a small attention model with the same fresh weights every time."""
    torch.manual_seed(0)
    return AttentionModel.from_config(tiny).eval()
