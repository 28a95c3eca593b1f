"""A saved episode: gone on with, it is the episode; spoilt or of other weights, it is refused."""

from pathlib import Path

from active_recon.errors import DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.meshes.photos import Photo
from active_recon.models.shape_basis import ShapeBasis, ShapeBasisConfig
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import find_weights
from active_recon.reconstructor import Reconstructor
from active_recon.saved_states import read_state, SavedState, write_state
import numpy as np
import pytest
from safetensors.numpy import load_file, save_file
from safetensors.torch import save_file as torch_file
import torch

SIZE = 0.2


def make(model=None, **options):
    return Reconstructor.load(find_weights(model), threads=1, **options)


@pytest.fixture(scope='module')
def reconstructor():
    return make(object_size=SIZE)


def views(count, first=0):
    for number in range(first, first + count):
        image = np.full((137, 137, 3), 255, np.uint8)
        image[50:90, 55:80 + 3 * number] = 60 + 20 * number
        yield image, orbit_camera(0.9 * number, 0.5, 2.1 * SIZE)


def episode(reconstructor, count=2):
    """Return the state of an episode of so many views."""
    reconstructor.reset()
    photos = []
    for image, camera in views(count):
        known = reconstructor.add_view(image, camera)
        photos.append(Photo.of(image, camera, SIZE))
    return SavedState(reconstructor.progress, known, photos, camera)


@pytest.fixture(scope='module')
def written(reconstructor, tmp_path_factory):
    path = tmp_path_factory.mktemp('state') / 'new' / 'mug.state.safetensors'
    write_state(episode(reconstructor), reconstructor, path)
    return path


def test_an_episode_goes_on_bit_by_bit_where_it_was_left(reconstructor, written):
    episode(reconstructor)
    expected = [reconstructor.add_view(*view) for view in views(2, 2)]
    other = make(object_size=SIZE)
    saved = read_state(written, other)
    other.go_on_from(saved.progress)
    assert other.view_count == 2
    for view, known in zip(views(2, 2), expected, strict=True):
        found = other.add_view(*view)
        np.testing.assert_array_equal(found.grid.occupancy, known.grid.occupancy)
        np.testing.assert_array_equal(found.latent, known.latent)
        assert found.quality == known.quality


def test_what_is_read_is_what_was_written(reconstructor, written):
    saved, before = read_state(written, reconstructor), episode(reconstructor)
    np.testing.assert_array_equal(saved.reconstruction.grid.occupancy,
                                  before.reconstruction.grid.occupancy)
    assert saved.reconstruction.grid.size == SIZE
    assert saved.reconstruction.quality == before.reconstruction.quality
    np.testing.assert_array_equal(saved.last_camera.pose, before.last_camera.pose)
    for one, other in zip(saved.photos, before.photos, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
        np.testing.assert_array_equal(one.camera.pose, other.camera.pose)
        assert one.camera.intrinsics == other.camera.intrinsics


def test_a_state_that_grows_with_the_views_comes_back(tmp_path):
    config = ShapeBasisConfig(categories=('box', 'none'), modes=2)
    path = tmp_path / 'basis.safetensors'
    save_weights(path, Bundle(ShapeBasis.from_config(config), None, config, 0.4,
                              model='shape-basis'))
    basis = Reconstructor.load(path, threads=1, object_size=SIZE)
    write_state(saved := episode(basis), basis, tmp_path / 'it.state.safetensors')
    found = read_state(tmp_path / 'it.state.safetensors', basis)
    for name, array in saved.progress.state.items():
        np.testing.assert_array_equal(found.progress.state[name], array)


def test_a_state_cut_anywhere_is_refused(reconstructor, written, tmp_path):
    whole, path = written.read_bytes(), tmp_path / 'cut.safetensors'
    for length in (0, 4, 100, 5000, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(DataError, match=r'cut.safetensors: (no readable|no) state'):
            read_state(path, reconstructor)


@pytest.mark.parametrize(('options', 'said'), [
    ({'model': 'r2n2'}, 'a state of other weights'),
    ({'object_size': 0.3}, 'a state of other object_size, metres: expected 0.3, got 0.2')])
def test_a_state_of_another_reconstructor_is_refused(options, said, written):
    with pytest.raises(DataError, match=said):
        read_state(written, make(**{'object_size': SIZE, **options}))


def metadata(path):
    from safetensors import safe_open

    with safe_open(path, 'np') as file:
        return file.metadata()


@pytest.mark.parametrize('spoil', [
    lambda arrays, facts: arrays.pop('state/hull'),
    lambda arrays, facts: arrays.update({'state/hull': arrays['state/hull'][:, :1]}),
    lambda arrays, facts: arrays.update(occupancy=arrays['occupancy'][:32]),
    lambda arrays, facts: arrays.update(occupancy=arrays['occupancy'] + 2),
    lambda arrays, facts: arrays.pop('image/1'),
    lambda arrays, facts: arrays.update({'image/1': arrays['image/1'][:9]}),
    lambda arrays, facts: arrays.update(last_pose=2 * arrays['last_pose']),
    lambda arrays, facts: arrays.update(seen_lenses=arrays['seen_lenses'] + np.inf),
    lambda arrays, facts: facts.update(views='many'),
    lambda arrays, facts: facts.update(quality='{"expected_iou": 2}')])
def test_a_spoilt_state_is_refused_in_one_line(spoil, reconstructor, written, tmp_path):
    arrays, facts, path = load_file(written), metadata(written), tmp_path / 'spoilt.safetensors'
    spoil(arrays, facts)
    save_file({name: np.ascontiguousarray(array) for name, array in arrays.items()}, path, facts)
    with pytest.raises(DataError, match='spoilt.safetensors: a spoilt state: expected what'):
        read_state(path, reconstructor)


def test_weights_are_no_state(reconstructor):
    with pytest.raises(DataError, match='no state: expected a file of save_state in format 1'):
        read_state(find_weights('r2n2'), reconstructor)


def test_weights_of_numbers_that_numpy_has_not_are_no_state(reconstructor, tmp_path):
    torch_file({'layer': torch.zeros(3, dtype=torch.bfloat16)}, tmp_path / 'bf16.safetensors')
    with pytest.raises(DataError, match='no state: expected a file of save_state in format 1'):
        read_state(tmp_path / 'bf16.safetensors', reconstructor)


def test_a_file_that_is_not_there_is_refused(reconstructor, tmp_path):
    with pytest.raises(DataError, match='none: no readable state'):
        read_state(tmp_path / 'none', reconstructor)


def test_a_state_may_be_read_by_whoever_may_read_a_new_file(reconstructor, tmp_path):
    write_state(episode(reconstructor, 1), reconstructor, tmp_path / 'mug.state.safetensors')
    (tmp_path / 'new').touch()
    modes = {path.stat().st_mode for path in tmp_path.iterdir()}
    assert len(modes) == 1


def test_a_state_that_cannot_be_written_is_refused_as_data(reconstructor):
    with pytest.raises(DataError):
        write_state(episode(reconstructor, 1), reconstructor, Path('/proc/mug.state.safetensors'))
