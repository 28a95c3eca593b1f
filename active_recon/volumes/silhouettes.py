"""
The perspective transformer of section 3.2: differentiable silhouettes of voxel grids.

The paper follows Yan et al. 2016 (Perspective Transformer Nets): the voxels are interpolated
trilinearly (the paper's V_i; here `grid_sample`) at a grid of samples in the camera's frustum,
and the maximum along each ray is the silhouette S.
"""

from collections.abc import Sequence
import math

from active_recon.geometry.cameras import Camera
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional


def frustum(cameras: Sequence[Camera], image_size: int = 32, depth_samples: int = 32,
            grid_side: float = 1.0) -> Tensor:
    """
    Return the sample positions of cameras in the grid, (cameras, D, S, S, 3), for `grid_sample`.

    Sample (d, v, u) of a camera lies on the ray through the centre of pixel (u, v) of an image of
    S x S pixels, at the d-th of D depths, evenly spaced over the grid's bounding sphere. The last
    axis is ordered z, y, x, and [-1, 1] spans the grid of `grid_side` metres.
    """
    samples = []
    for camera in cameras:
        lens = camera.intrinsics.resized(image_size, image_size)
        rays = Camera(camera.pose, lens).ray_directions()  # (S, S, 3)
        radius = grid_side * math.sqrt(3) / 2
        steps = (np.arange(depth_samples) + 0.5) / depth_samples
        depths = camera.distance + (2 * steps - 1) * radius  # (D,)
        points = camera.position + depths[:, None, None, None] * rays  # (D, S, S, 3)
        samples.append(points[..., ::-1] * (2 / grid_side))
    return torch.from_numpy(np.stack(samples).astype(np.float32))


def project(occupancy: Tensor, samples: Tensor) -> Tensor:
    """
    Return the silhouettes of voxel grids, each from its own frustum, (B, S, S) in [0, 1].

    Takes occupancies (B, X, Y, Z) in [0, 1] and samples (B, D, S, S, 3) from `frustum`. The
    occupancy outside of the grid is 0.
    """
    samples = samples.to(occupancy.dtype)
    volume = occupancy[:, None]
    with torch.no_grad():
        along_rays = functional.grid_sample(volume, samples, align_corners=False)[:, 0]
        deepest = along_rays.argmax(dim=1)  # (B, S, S)
    # The maximum's gradient flows through its one sample, so only that is sampled again: the
    # same values and gradients as a plain maximum, at a fraction of the backward pass.
    index = deepest[:, None, :, :, None].expand(-1, 1, -1, -1, 3)
    return functional.grid_sample(
        volume, samples.gather(1, index), align_corners=False)[:, 0, 0]


def project_all(occupancy: Tensor, samples: Tensor) -> Tensor:
    """Return silhouettes (B, V, S, S) of grids (B, X, Y, Z) from frustums (V, D, S, S, 3)."""
    views = [project(occupancy, one.expand(len(occupancy), *one.shape)) for one in samples]
    return torch.stack(views, dim=1)
