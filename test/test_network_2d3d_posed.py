"""The 2D-3D network that is told of the camera: what it is told, and that it can use it."""

import math

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.models.network import Cameras
from active_recon.models.network_2d3d_posed import (
    camera_numbers,
    Network2d3dPosed,
    Network2d3dPosedConfig,
)
import pytest
from shown_views import cameras_at
import torch
from torch.nn import functional
from torch.testing import assert_close

LENS = Intrinsics(140, 140, 64, 64, 128, 128)


@pytest.fixture
def posed():
    torch.manual_seed(0)
    return Network2d3dPosed.from_config(Network2d3dPosedConfig(
        stem_channels=8, block_channels=(8, 16, 16), recurrent_channels=16,
        bottleneck_channels=32, latent_channels=4, volume_channels=16, decoder_channels=(16, 8),
        camera_channels=16)).eval()


def numbers_of(camera):
    return camera_numbers(Cameras.of([camera]), 128)[0]


def test_a_camera_is_told_by_its_direction_distance_axes_and_lens():
    camera = orbit_camera(math.pi / 2, 0.0, 2.0, LENS)  # on +y
    assert_close(numbers_of(camera), torch.tensor(
        [0, 1, 0, math.log(2), 0, -1, 0, 0, 0, 1, math.log(140 / 128)]))


def test_directions_turn_with_the_frame_and_nothing_else_does():
    camera = orbit_camera(0.4, 0.3, 1.9, LENS)
    here, there = numbers_of(camera), numbers_of(camera.turned(0.7))
    sine, cosine = math.sin(0.7), math.cos(0.7)
    turn = torch.tensor([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    for first in (0, 4, 7):
        assert_close(there[first:first + 3], turn @ here[first:first + 3])
    assert_close(there[[3, 10]], here[[3, 10]])


def test_the_same_lens_in_finer_pixels_is_the_same_camera():
    fine = Camera(orbit_camera(0.4, 0.3, 1.9).pose, LENS.resized(256, 256))
    assert_close(camera_numbers(Cameras.of([fine]), 256)[0],
                 numbers_of(Camera(fine.pose, LENS)))


@pytest.mark.slow
def test_one_image_is_learned_to_be_two_shapes_from_two_sides(posed):
    images = torch.rand(1, 3, 128, 128).expand(2, -1, -1, -1)
    cameras, voxels = cameras_at([0.0, math.pi / 2], 128), torch.zeros(2, 32, 32, 32)
    voxels[0, 4:28, 12:20, 12:20] = voxels[1, 12:20, 4:28, 12:20] = 1
    optimizer = torch.optim.Adam(posed.parameters(), 5e-3)
    for _ in range(60):
        logits, _ = posed(images, cameras, posed.initial_state(2))
        optimizer.zero_grad()
        functional.binary_cross_entropy_with_logits(logits, voxels).backward()
        optimizer.step()
    with torch.no_grad():
        logits, _ = posed(images, cameras, posed.initial_state(2))
    assert logits[0][voxels[0] > voxels[1]].mean() > logits[0][voxels[1] > voxels[0]].mean() + 2
    assert logits[1][voxels[1] > voxels[0]].mean() > logits[1][voxels[0] > voxels[1]].mean() + 2


@torch.no_grad()
def test_an_image_without_a_fourth_channel_was_seen_whole(posed):
    images, camera = torch.rand(1, 3, 128, 128), cameras_at([0.0], 128)
    plain, whole, half = (posed.encode(each, camera) for each in (
        images, torch.cat([images, torch.ones(1, 1, 128, 128)], 1),
        torch.cat([images, torch.ones(1, 1, 128, 128).triu()], 1)))
    assert_close(plain, whole)
    assert (plain - half).abs().max() > 1e-3


@torch.no_grad()
def test_an_encoding_does_not_depend_on_the_camera(posed):
    images = torch.rand(2, 3, 128, 128)
    assert_close(posed.encode(images, cameras_at([0.0, 1.0], 128)),
                 posed.encode(images, cameras_at([2.0, 3.0], 128)), rtol=0, atol=0)
