"""JSON text of others: what is nested too deep is refused like all else that is no JSON."""

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.splits import list_split
from active_recon.errors import DataError, WeightsError
from active_recon.json_text import json_value
from active_recon.models.weights_files import read_card
from active_recon.photos.transforms_json import read_transforms
from active_recon.quality.tables import QualityTables
from active_recon.runtimes.graph_files import read_graph_metadata
from active_recon.training.checkpoints import step_reached
import numpy as np
import pytest
from safetensors.numpy import save_file

DEEP = '[' * 100_000


def cameras_of(path):
    """Read a file as that of an object's cameras."""
    folder = ObjectFolder(path.parent, 'box', 'one')
    folder.images_folder.mkdir(parents=True)
    path.rename(folder.images_folder / 'cameras.json')
    return folder.cameras()


@pytest.mark.parametrize('text', ['[1', DEEP, '{"a":' * 100_000, '9' * 5000])
def test_whatever_is_no_json_is_one_error(text):
    with pytest.raises(ValueError, match='.'):
        json_value(text)


@pytest.mark.parametrize(('read', 'kind'), [
    (read_transforms, DataError), (cameras_of, DataError), (QualityTables.read, WeightsError),
    (lambda path: read_card(path.with_suffix('.safetensors')), WeightsError),
    (lambda path: read_graph_metadata(path, path.read_text(), 'encode', 64 * 'a'), WeightsError)])
def test_what_is_nested_too_deep_is_refused_in_words(tmp_path, read, kind):
    path = tmp_path / 'any.json'
    path.write_text(DEEP)
    with pytest.raises(kind, match='nested too deep'):
        read(path)


def test_a_split_that_is_nested_too_deep_is_refused_in_words(dataset, tmp_path):
    (tmp_path / 'split.json').write_text(DEEP)
    with pytest.raises(DataError, match='no readable split file: expected JSON, got: nested too'):
        list_split(dataset, tmp_path / 'split.json', 'test')


def test_a_checkpoint_that_is_nested_too_deep_is_no_whole_one(tmp_path):
    save_file({'step': np.zeros(1)}, tmp_path / 'any.safetensors', {'checkpoint': DEEP})
    assert step_reached(tmp_path / 'any.safetensors') == 0


def test_an_image_of_endless_width_is_refused(tmp_path):
    path = tmp_path / 'cameras.json'
    path.write_text('[{"pose": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], '
                    '"fx": 1, "fy": 1, "cx": 1, "cy": 1, "width": Infinity, "height": 2}]')
    with pytest.raises(DataError, match='no readable cameras'):
        cameras_of(path)
