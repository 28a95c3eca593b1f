"""The perspective transformer: where voxels land, what flows back, what does not mix."""

import math

from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.volumes.silhouettes import frustum, project, project_all
import numpy as np
import pytest
import torch
from torch.nn import functional
from torch.testing import assert_close

CAMERAS = [orbit_camera(azimuth, elevation) for azimuth, elevation in (
    (0.0, 0.0), (0.4, math.radians(30)), (2.0, math.radians(30)), (4.5, -0.5))]


@pytest.fixture(scope='module')
def samples():
    return frustum(CAMERAS)


def test_sample_points_lie_on_the_rays_of_their_pixels(samples):
    for camera, points in zip(CAMERAS, samples.numpy(), strict=True):
        lens = camera.intrinsics.resized(32, 32)
        metres = points[..., ::-1].reshape(-1, 3) / 2
        pixels, depths = Camera(camera.pose, lens).project(metres)
        row, column = np.indices((32, 32))
        expected = np.stack([column, row], axis=-1) + 0.5
        np.testing.assert_allclose(pixels.reshape(32, 32, 32, 2) - expected, 0, atol=1e-3)
        assert (np.diff(depths.reshape(32, 32, 32), axis=0) > 0).all()


@pytest.mark.parametrize('cell', [(16, 16, 16), (2, 16, 16), (16, 2, 16), (16, 16, 29),
                                  (25, 6, 10), (4, 27, 20)])
@pytest.mark.parametrize('size', [1.0, 0.3])
def test_a_projected_voxel_lands_where_the_camera_says(cell, size):
    cameras = [orbit_camera(camera.azimuth, camera.elevation, camera.distance * size)
               for camera in CAMERAS]
    occupancy = torch.zeros(1, 32, 32, 32)
    occupancy[0][cell] = 1
    center = (np.array(cell) + 0.5) / 32 * size - size / 2
    images = project_all(occupancy, frustum(cameras, 64, 128, size))[0].numpy()
    for camera, image in zip(cameras, images, strict=True):
        lens = camera.intrinsics.resized(64, 64)
        (expected,), _ = Camera(camera.pose, lens).project([center])
        brightest = np.unravel_index(image.argmax(), image.shape)
        row, column = brightest
        np.testing.assert_allclose([column + 0.5, row + 0.5], expected, atol=1)
        assert image.max() > 0.2
        weights = image / image.sum()
        middle = [(weights.sum(0) * (np.arange(64) + 0.5)).sum(),
                  (weights.sum(1) * (np.arange(64) + 0.5)).sum()]
        np.testing.assert_allclose(middle, expected, atol=0.3)


def test_values_and_gradients_are_those_of_a_plain_maximum_along_the_ray(samples):
    torch.manual_seed(0)
    occupancy = torch.rand(len(samples), 32, 32, 32, requires_grad=True)
    weights = torch.randn(len(samples), 32, 32)
    ours = project(occupancy, samples)
    (gradient,) = torch.autograd.grad((ours * weights).sum(), occupancy)
    plain = functional.grid_sample(occupancy[:, None], samples, align_corners=False)[:, 0]
    plain = plain.max(dim=1).values
    (expected,) = torch.autograd.grad((plain * weights).sum(), occupancy)
    assert_close(ours, plain)
    assert_close(gradient, expected)
    assert gradient.abs().sum() > 0


def test_gradients_are_those_of_finite_differences():
    samples = frustum(CAMERAS[1:2], 4, 6).double()
    torch.manual_seed(0)
    occupancy = torch.rand(1, 4, 4, 4, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda grid: project(grid, samples), occupancy)


def test_a_silhouette_s_error_teaches_the_voxels_that_made_it(samples):
    occupancy = torch.full((1, 32, 32, 32), 0.1, requires_grad=True)
    project(occupancy, samples[:1]).sum().backward()
    assert (occupancy.grad >= 0).all()
    assert occupancy.grad.sum() == pytest.approx(
        float((project(torch.ones(1, 32, 32, 32), samples[:1])).sum()), rel=1e-4)


def test_objects_of_a_batch_do_not_mix(samples):
    occupancy = torch.rand(4, 32, 32, 32)
    together = project(occupancy, samples)
    for index in range(4):
        alone = project(occupancy[index:index + 1], samples[index:index + 1])
        assert_close(together[index:index + 1], alone)


def test_all_silhouettes_are_those_of_each_object_from_each_camera(samples):
    occupancy = torch.rand(3, 32, 32, 32)
    silhouettes = project_all(occupancy, samples)
    assert silhouettes.shape == (3, 4, 32, 32)
    assert_close(silhouettes[2, 1], project(occupancy[2:], samples[1:2])[0])


def test_an_empty_grid_has_an_empty_silhouette(samples):
    assert not project(torch.zeros(4, 32, 32, 32), samples).any()


def test_a_full_grid_fills_the_middle_and_leaves_the_corners(samples):
    silhouettes = project(torch.ones(4, 32, 32, 32), samples)
    assert_close(silhouettes[:, 12:20, 12:20], torch.ones(4, 8, 8))
    assert not silhouettes[:, [0, 0, -1, -1], [0, -1, 0, -1]].any()


def test_silhouettes_stay_probabilities(samples):
    silhouettes = project(torch.rand(4, 32, 32, 32), samples)
    assert ((silhouettes >= 0) & (silhouettes <= 1)).all()
