"""The registry of reconstruction networks, each in its published size and in a small one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import os
from typing import Any

from active_recon.config import Config, LossConfig
from active_recon.errors import ConfigError
from active_recon.models.attention import AttentionModel
from active_recon.models.carving import carve_nothing, Carving, CarvingConfig
from active_recon.models.carving import SIZES as SIZES_CARVING
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.lifting import SIZES as SIZES_LIFTING
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.network_2d3d import Network2d3d, Network2d3dConfig
from active_recon.models.network_2d3d import SIZES as SIZES_2D3D
from active_recon.models.network_2d3d_posed import Network2d3dPosed, Network2d3dPosedConfig
from active_recon.models.network_2d3d_posed import SIZES as SIZES_2D3D_POSED
from active_recon.models.ogn import Ogn, OgnConfig
from active_recon.models.ogn import SIZES as SIZES_OGN
from active_recon.models.ptn import PerspectiveTransformerNet, PtnConfig
from active_recon.models.ptn import SIZES as SIZES_PTN
from active_recon.models.r2n2 import R2n2, R2n2Config
from active_recon.models.r2n2 import SIZES as SIZES_R2N2
from active_recon.models.shape_basis import fit_shapes, ShapeBasis, ShapeBasisConfig
from active_recon.models.shape_basis import SIZES as SIZES_SHAPE_BASIS
from active_recon.plugins import (
    installed,
    is_in_file,
    load_from_file,
    load_installed,
    NETWORKS_GROUP,
)
import numpy as np
from numpy.typing import NDArray
from torch import nn, Tensor


@dataclass(frozen=True)
class NetworkEntry:
    """
    How a network is built, its sizes, and its losses.

    `small` trains on two CPU cores within an hour. `policy` builds the model of the view policy
    that is trained with it, if it has one. `fit` replaces training for a network that is fitted
    in one go, to voxels (N, R, R, R) and categories (N,).
    """

    config: type[Config]
    build: Callable[[Any], ReconstructionNetwork]
    sizes: Mapping[str, Config]
    loss: LossConfig = LossConfig()
    policy: Callable[[Any], nn.Module] | None = None
    fit: Callable[[Any, Tensor, NDArray[np.str_]], None] | None = None


_POSED_LOSS = LossConfig(volume_weight=1, silhouette_weight=0, volume_loss='bce+dice')

NETWORKS: Mapping[str, NetworkEntry] = {
    '2d3d-attention': NetworkEntry(
        Network2d3dConfig, Network2d3d.from_config, SIZES_2D3D,
        policy=AttentionModel.from_config),
    '2d3d': NetworkEntry(Network2d3dConfig, Network2d3d.from_config, SIZES_2D3D),
    '2d3d-posed': NetworkEntry(Network2d3dPosedConfig, Network2d3dPosed.from_config,
                               SIZES_2D3D_POSED, _POSED_LOSS),
    'r2n2': NetworkEntry(R2n2Config, R2n2.from_config, SIZES_R2N2,
                         LossConfig(volume_weight=1, silhouette_weight=0, volume_loss='bce')),
    'ptn': NetworkEntry(PtnConfig, PerspectiveTransformerNet.from_config, SIZES_PTN,
                        LossConfig(volume_weight=0, silhouette_weight=1)),
    'ptn-combined': NetworkEntry(PtnConfig, PerspectiveTransformerNet.from_config, SIZES_PTN,
                                 LossConfig(volume_weight=0.5, silhouette_weight=0.5)),
    'ogn': NetworkEntry(OgnConfig, Ogn.from_config, SIZES_OGN),  # learns from its own objective
    'shape-basis': NetworkEntry(ShapeBasisConfig, ShapeBasis.from_config, SIZES_SHAPE_BASIS,
                                fit=fit_shapes),
    'lifting': NetworkEntry(LiftingConfig, Lifting.from_config, SIZES_LIFTING, _POSED_LOSS),
    'carving': NetworkEntry(CarvingConfig, Carving.from_config, SIZES_CARVING,
                            fit=carve_nothing),
}


_OWN: dict[str, NetworkEntry] = {}
OWN_NETWORKS = 'ACTIVE_RECON_NETWORKS'
"""The environment variable that names networks in files, separated by commas."""


def named_network(reference: str) -> str:
    """
    Return the name of a network, loading it where `reference` is of the form my_file.py:Net.

    Raises ConfigError where a file is named alone, has no such network, or its name is already
    taken.
    """
    if not is_in_file(reference):
        if reference.endswith('.py'):
            raise ConfigError(f'{reference}: which network of this file? Expected '
                              f'{reference}:Net, where Net is its class')
        return reference
    name = reference.rpartition(':')[2]
    if name in NETWORKS:
        raise ConfigError(f'{reference}: {name} is the name of a network of this package')
    _OWN[name] = _own_entry(reference, load_from_file(reference))
    return name


def network_entry(name: str) -> NetworkEntry:
    """
    Return a network's entry: of the registry, of a file, or of an installed package.

    Raises ConfigError naming those of the registry. A weights file cannot name a Python file: only
    the user of the command can.
    """
    if name in NETWORKS:
        return NETWORKS[name]
    if name not in _OWN:
        for reference in map(str.strip, os.environ.get(OWN_NETWORKS, '').split(',')):
            if reference.rpartition(':')[2] == name:
                named_network(reference)
    if name in _OWN:
        return _OWN[name]
    if name in installed(NETWORKS_GROUP):
        return _own_entry(name, load_installed(NETWORKS_GROUP, name))
    raise ConfigError(f'no network is called {name!r}: expected one of '
                      f'{", ".join(NETWORKS)}, one that an installed package offers as '
                      f'{NETWORKS_GROUP}, or one in a file that '
                      f'{OWN_NETWORKS}=my_file.py:{name} names')


def _own_entry(reference: str, found: Any) -> NetworkEntry:
    """Return an entry as it is, or that of a network whose class has its `Config`."""
    if isinstance(found, NetworkEntry):
        return found
    config = getattr(found, 'Config', None)
    if not (isinstance(found, type) and issubclass(found, ReconstructionNetwork)
            and isinstance(config, type) and issubclass(config, Config)):
        raise ConfigError(f'{reference}: neither a NetworkEntry nor a ReconstructionNetwork with '
                          'a Config of its own')
    try:
        small = config()
    except TypeError as error:
        raise ConfigError(f'{reference}: a Config without defaults: expected one for each of its '
                          f'fields, got: {error}') from error
    return NetworkEntry(config, found, {'small': small}, getattr(found, 'loss', LossConfig()))


def network_config(name: str, size: str) -> Config:
    """Return a network's configuration of a size; raises ConfigError naming the sizes."""
    sizes = network_entry(name).sizes
    if size not in sizes:
        raise ConfigError(f'{name} has no size {size!r}: expected one of {", ".join(sizes)}')
    return sizes[size]
