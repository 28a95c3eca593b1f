"""PNG files are written whole, or an error tells which one could not be."""

from active_recon.errors import DataError
from active_recon.png_files import write_png
import cv2
import numpy as np
import pytest
from recorded_messages import small_disk

PIXELS = np.random.default_rng(0).integers(0, 256, (40, 50, 3), np.uint8)


def test_an_image_is_read_as_it_was_written(tmp_path):
    write_png(tmp_path / 'it.png', PIXELS[..., ::-1])
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / 'it.png')), PIXELS[..., ::-1])


def test_an_image_that_finds_no_room_leaves_what_was_there(tmp_path):
    write_png(tmp_path / 'it.png', PIXELS[:2])
    with small_disk(1000), pytest.raises(DataError, match=r'it\.png: cannot be written: File too'):
        write_png(tmp_path / 'it.png', PIXELS)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / 'it.png')), PIXELS[:2])
    assert [path.name for path in tmp_path.iterdir()] == ['it.png']
