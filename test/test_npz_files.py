"""What is read of a file of arrays is what was written, or nothing."""

from dataclasses import fields

from active_recon.errors import DataError
from active_recon.evaluation.quality.measuring import Measured
from active_recon.evaluation.trial import read_arrays
from active_recon.npz_files import read_npz
from active_recon.training.view_gains import ViewGains
import numpy as np
import pytest

READERS = [Measured.read, ViewGains.load, lambda path: read_arrays(path, {'iou'})]


@pytest.mark.parametrize('save', [np.savez, np.savez_compressed])
def test_a_file_that_is_damaged_anywhere_gives_what_was_written_or_is_refused(tmp_path, save):
    rng, path = np.random.default_rng(0), tmp_path / 'it.npz'
    arrays = {'iou': rng.integers(9, size=99), 'names': np.array(['one', 'another'])}
    save(path, **arrays)
    whole, refused = path.read_bytes(), 0
    for at in range(len(whole)):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ rng.integers(1, 256)]) + whole[at + 1:])
        try:
            found = read_npz(path, arrays)
        except (OSError, ValueError):
            refused += 1
        else:
            for name, array in arrays.items():
                np.testing.assert_array_equal(found[name], array)
    assert refused > len(whole) / 2


@pytest.mark.parametrize('read', READERS)
def test_results_that_are_damaged_inside_are_refused_by_name(tmp_path, read):
    path = tmp_path / 'it.npz'
    np.savez_compressed(path, **dict.fromkeys(
        (*(each.name for each in (*fields(Measured), *fields(ViewGains))),),
        np.random.default_rng(1).normal(size=500)))
    whole = path.read_bytes()
    damaged = bytearray(whole)
    for name in fields(ViewGains) + fields(Measured):  # inside of what is packed
        first = whole.index(f'{name.name}.npy'.encode()) + 90
        damaged[first:first + 40] = b'\xff' * 40
    path.write_bytes(damaged)
    with pytest.raises(DataError, match=r'it.npz: .*, got: \w*[Ee]rror'):
        read(path)
