"""Carving keeps what no silhouette rules out, and rules out nothing that a camera did not see."""

import math

from active_recon.config import LossConfig
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.geometry.canonical import framing_camera
from active_recon.models.border import border_distance, border_evenness, foreground
from active_recon.models.carving import Carving, CarvingConfig
from active_recon.models.network import Cameras
from active_recon.models.registry import network_entry
from active_recon.models.weights import Bundle, load_weights, save_weights
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
import numpy as np
import pytest
import torch
from torch.nn import functional
from torch.testing import assert_close
import trimesh


@pytest.fixture(scope='module')
def bar():
    return trimesh.creation.box((1.0, 0.4, 0.6))


PLACES = [(20, 30), (75, 5), (140, 60), (215, 20), (290, -5), (330, 80)]


def shown(mesh, background=255):
    """Return images (N, 3, 128, 128) of a mesh from all places, and their cameras."""
    lens = Intrinsics(200, 200, 64, 64, 128, 128)
    cameras = [framing_camera(orbit_camera(math.radians(azimuth), math.radians(elevation), 2.1,
                                           lens), 1.0, 128) for azimuth, elevation in PLACES]
    renderer = Renderer(mesh)
    images = [composite(renderer.render(camera), background) for camera in cameras]
    return (torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2).float() / 255,
            Cameras.of(cameras))


def carved(images, cameras):
    network = Carving(0)
    state = network.initial_state(1)
    for view in range(len(images)):
        one = slice(view, view + 1)
        state = network.step(images[one], cameras.rows(one), state)
    return network.decode(state)[0] > 0


@pytest.mark.parametrize('background', [255, 0, 30])
def test_a_box_is_carved_out_of_any_plain_background(bar, background):
    truth = torch.from_numpy(voxelise(bar, 64).occupied(0.5))
    left = carved(*shown(bar, background))
    assert (left & truth).sum() > 0.93 * truth.sum()
    assert (left & truth).sum() > 0.75 * (left | truth).sum()


def test_more_views_only_take_away(bar):
    images, cameras = shown(bar)
    after = [carved(images[:count], cameras.rows(slice(0, count))) for count in (1, 3, 6)]
    assert after[0].sum() > after[1].sum() > after[2].sum()
    assert not (after[1] & ~after[0]).any() and not (after[2] & ~after[1]).any()


def test_what_was_not_seen_stays(bar):
    images, cameras = shown(bar)
    seen = torch.ones(1, 1, 128, 128)
    seen[..., :64] = 0
    half = torch.cat([images[:1] * seen, seen], dim=1)
    one = cameras.rows(slice(0, 1))
    whole, cut = carved(images[:1], one), carved(half, one)
    assert not (whole & ~cut).any() and cut.sum() > whole.sum()
    assert carved(torch.cat([images[:1], 0 * seen], dim=1), one).all()


def test_the_background_is_what_the_border_shows():
    image = torch.full((1, 3, 128, 128), 0.3)
    image[..., 40:80, 50:90] = 0.6
    share = foreground(image)
    assert share[..., 40:80, 50:90].eq(1).all()
    assert share.sum() == 40 * 40


def blurred_square(behind, color):
    """Return the share of a square that is out of focus in each pixel, and an image of it."""
    share = torch.zeros(1, 1, 128, 128)
    share[..., 40:80, 50:90] = 1
    share = functional.avg_pool2d(share, 2, 1)  # the edges fall on the middle of a pixel
    share = functional.pad(share, (1, 0, 1, 0))
    return share, behind + share * (color - behind)


@pytest.mark.parametrize(('behind', 'color'), [(0.3, 0.6), (1.0, 0.1), (0.0, 0.9)])
def test_a_pixel_at_the_edge_is_foreground_by_its_share_of_the_mixture(behind, color):
    share, image = blurred_square(behind, color)
    assert_close(foreground(image.expand(-1, 3, -1, -1)), share, atol=0.01, rtol=0)


def test_the_inside_of_an_object_that_hardly_differs_from_the_background_is_foreground():
    share, image = blurred_square(0.5, 0.56)
    assert_close(foreground(image.expand(-1, 3, -1, -1))[share > 0.8], share[share > 0.8])


def test_where_an_image_ends_is_no_edge_of_the_background():
    image = torch.full((1, 4, 128, 128), 0.3)
    image[:, :3, 40:80, 50:] = 0.6  # the object goes on where nothing was seen
    image[:, :, :, 100:] = 0
    assert foreground(image)[..., 40:80, 50:].eq(1).all()
    assert foreground(image)[..., 100:].eq(1).all()


def test_a_border_tells_of_the_background_where_it_is_of_one_colour():
    even = torch.full((1, 3, 128, 128), 0.3)
    even[..., 100:, 50:90] = 0.6  # the object meets the border
    scattered = torch.rand(1, 3, 128, 128, generator=torch.Generator().manual_seed(0))
    told = [border_evenness(border_distance(images), images).item()
            for images in (even, scattered, torch.zeros(1, 4, 128, 128))]
    assert told[0] == 1 and told[1] == 0 and told[2] == 0


def test_a_dilated_silhouette_leaves_more(bar):
    images, cameras = shown(bar)
    one = cameras.rows(slice(0, 1))
    rows = [Carving(reach).encode(images[:1], one).sum() for reach in (0, 1, 3)]
    assert rows[0] < rows[1] < rows[2]


def test_carving_is_written_and_read_as_any_network(tmp_path, bar):
    entry = network_entry('carving')
    config = CarvingConfig(2)
    assert entry.loss == LossConfig()
    path = tmp_path / 'carving.safetensors'
    save_weights(path, Bundle(entry.build(config), None, config, 0.5, model='carving'))
    network = load_weights(path).reconstruction
    images, cameras = shown(bar)
    assert_close(network(images, cameras, network.initial_state(6))[0],
                 Carving(2)(images, cameras, Carving(2).initial_state(6))[0])


def test_a_dilation_that_is_none_is_refused():
    with pytest.raises(ConfigError, match='0 to 16 pixels'):
        CarvingConfig(-1)
