"""Photos have the colours that were taken, in sRGB, whatever profile their files name."""

import struct

from active_recon.photos.files import open_photos, read_photo
import numpy as np
from PIL import Image, ImageCms
import pytest

# Of ICC's D50, with Bradford's adaptation: columns of Display P3 and of Adobe RGB, rows X, Y, Z
DISPLAY_P3 = [[0.51512, 0.29198, 0.15710], [0.24120, 0.69225, 0.06657],
              [-0.00105, 0.04189, 0.78407]]
ADOBE_RGB = [[0.60974, 0.20528, 0.14919], [0.31111, 0.62567, 0.06322],
             [0.01947, 0.06087, 0.74457]]
GAMMA = 2.2
SRGB, LAB = (ImageCms.ImageCmsProfile(ImageCms.createProfile(name)).tobytes()
             for name in ('sRGB', 'LAB'))


def profile(matrix):
    """Return an ICC profile, version 2, of a display with these primaries and a gamma of 2.2."""
    def xyz(values):
        return b'XYZ \0\0\0\0' + struct.pack('>3i', *(round(each * 65536) for each in values))

    curve = b'curv\0\0\0\0' + struct.pack('>IH', 1, round(GAMMA * 256)) + b'\0\0'
    text = b'another display\0'
    description = b'desc\0\0\0\0' + struct.pack('>I', len(text)) + text + bytes(78 + 12)
    tags = {b'desc': description, b'cprt': b'text\0\0\0\0none\0\0\0\0',
            b'wtpt': xyz((0.9642, 1, 0.8249)),
            **{name: xyz(column) for name, column in zip(
                (b'rXYZ', b'gXYZ', b'bXYZ'), zip(*matrix, strict=True), strict=True)},
            **dict.fromkeys((b'rTRC', b'gTRC', b'bTRC'), curve)}
    at, table, data = 128 + 4 + 12 * len(tags), b'', b''
    for name, value in tags.items():
        value += bytes(-len(value) % 4)
        table += name + struct.pack('>2I', at + len(data), len(value))
        data += value
    header = (struct.pack('>I', at + len(data)) + b'lcms' + struct.pack('>I', 0x02400000)
              + b'mntrRGB XYZ ' + bytes(12) + b'acsp' + bytes(28)
              + struct.pack('>3i', 63190, 65536, 54061)).ljust(128, b'\0')
    return header + struct.pack('>I', len(tags)) + table + data


def expected(color, matrix):
    """Return an sRGB colour, (3,) in [0, 255], by the definition of both spaces."""
    srgb = np.array([[0.43607, 0.38515, 0.14307], [0.22249, 0.71687, 0.06061],
                     [0.01392, 0.09708, 0.71410]])
    light = np.linalg.solve(srgb, np.array(matrix) @ (np.array(color) / 255) ** GAMMA).clip(0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def read(path, image, **saved):
    Image.fromarray(image).save(path, **saved)
    [photo], _ = open_photos([path])
    return read_photo(photo)


@pytest.mark.parametrize('matrix', [DISPLAY_P3, ADOBE_RGB], ids=['Display P3', 'Adobe RGB'])
@pytest.mark.parametrize('color', [(180, 60, 60), (60, 160, 90), (70, 80, 170), (128, 128, 128)])
@pytest.mark.parametrize('channels', [3, 4])
def test_colors_of_another_space_become_those_of_srgb(color, matrix, channels, tmp_path):
    image = np.tile(np.array([*color, 100][:channels], np.uint8), (8, 8, 1))
    found = read(tmp_path / 'a.png', image, icc_profile=profile(matrix))
    assert found.shape == image.shape
    assert np.abs(found[0, 0, :3] - expected(color, matrix)).max() <= 2
    assert (found[..., 3:] == 100).all()


@pytest.mark.parametrize('named', [None, b'no profile at all', SRGB, LAB],
                         ids=['without', 'damaged', 'sRGB', 'not of RGB'])
def test_colors_stay_to_the_bit_without_a_profile_of_another_space(named, tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (8, 8, 3), np.uint8)
    np.testing.assert_array_equal(read(tmp_path / 'a.png', image, icc_profile=named), image)


def test_a_grey_photo_with_a_profile_is_read(tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (8, 8), np.uint8)
    found = read(tmp_path / 'a.png', image, icc_profile=profile(DISPLAY_P3))
    np.testing.assert_array_equal(found, np.repeat(image[..., None], 3, axis=2))
