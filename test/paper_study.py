"""A study of six objects and of networks that were never trained, for the tests of `paper`."""

from pathlib import Path

from active_recon.models.attention import AttentionModel
from active_recon.models.network_2d3d import Network2d3d, Network2d3dConfig
from active_recon.models.ogn import Ogn, OgnConfig
from active_recon.models.weights import Bundle, save_weights
from active_recon.paper import systems, table1, table2
from active_recon.paper.study import Study
import torch

SETS = ('train', 'val', 'test', 'unseen', 'real_cc0')


def make_study(folder: Path, dataset: Path, tiny: Network2d3dConfig) -> Study:
    """Return a study whose sets are all the same six objects, and whose weights are all there."""
    data, models = folder / 'data', folder / 'models'
    data.mkdir()
    for name in SETS:
        (data / name).symlink_to(dataset)
    (data / 'generators.sha256').write_text('ab' * 32 + '\n')
    for seed, system in enumerate(systems.SYSTEMS):
        untrained(models / system.name, tiny, seed, octree=system.model == 'ogn')
    for seed, name in enumerate(('two-stage', 'joint')):
        untrained(models / 'table1' / name, tiny, 20 + seed)
    study = Study(data, models, folder / 'results',
                  str(models / 'two-stage' / 'weights.safetensors'), samples=72, starts=2,
                  threads=1, policy_seeds=1, policy_starts=2, subset_objects=0, views=3)
    root = table2.objects(study)['val'].root.parent
    for seed, pair in enumerate(table2.published.TABLE2):
        untrained(root / f'{pair[0]:g}-{pair[1]:g}', tiny, 40 + seed)
    return study


def untrained(folder: Path, tiny: Network2d3dConfig, seed: int, octree: bool = False) -> Path:
    """Write weights that nobody trained; return where they lie."""
    torch.manual_seed(seed)
    path = folder / 'weights.safetensors'
    card = {'reconstruction': {'steps': 1, 'batch_size': 32, 'max_views': 5}}
    if octree:
        config = OgnConfig((4, 4), (32,), (8, 8, 8))
        save_weights(path, Bundle(Ogn.from_config(config), None, config, 0.3, card, 'ogn'))
    else:
        save_weights(path, Bundle(Network2d3d.from_config(tiny), AttentionModel.from_config(tiny),
                                  tiny, 0.1, card))
    return path


def small_objects(monkeypatch) -> None:
    """Let the parts that want a category of their own take one that is there, and be fast."""
    monkeypatch.setattr(table1, 'CATEGORY', 'table')
    monkeypatch.setattr(table2, 'generators_hash', lambda: 'ab' * 32)
    monkeypatch.setattr(table2, 'CATEGORY', 'lamp')
    monkeypatch.setattr(table2, 'COUNTS', {'train': 1, 'val': 1, 'test': 2})
