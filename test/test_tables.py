"""Tables stand under objects: seen from above alone, shaded where the object is in the way."""

from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.models.lifted import projected, projection
from active_recon.models.network import Cameras
from active_recon.training.tables import draw_tables
import numpy as np
import pytest
import torch
from torch.testing import assert_close

SIDE = 128


def seen_from(elevation):
    """Return three cameras at an elevation in radians, about two objects, (3, 2, ...)."""
    lens = Intrinsics(150.0, 150.0, SIDE / 2, SIDE / 2, SIDE, SIDE)
    each = Cameras.of([orbit_camera(azimuth, elevation, 2.0, lens)
                       for azimuth in (0.0, 1.0, 4.0) for _ in range(2)])
    return Cameras(*(part.unflatten(0, (3, 2)) for part in each))


def posts():
    """Return two posts that stand in the middle of their grids, on cell 8 and on cell 16."""
    voxels = torch.zeros(2, 64, 64, 64)
    voxels[0, 28:36, 28:36, 8:40] = 1
    voxels[1, 28:36, 28:36, 16:40] = 1
    return voxels


def test_from_below_no_table_is_seen():
    assert not draw_tables(seen_from(-0.3), posts(), SIDE, np.random.default_rng(0)).any()


def test_a_table_is_premultiplied_and_in_range():
    seen = draw_tables(seen_from(0.6), posts(), SIDE, np.random.default_rng(1))
    assert seen.shape == (3, 2, 4, SIDE, SIDE)
    assert seen.min() >= 0 and (seen[:, :, :3] <= seen[:, :, 3:]).all()
    assert seen[:, :, 3].any()


@pytest.mark.parametrize('seed', range(4))
def test_views_of_a_table_agree_on_what_lies_at_one_place(seed):
    cameras = seen_from(0.9)
    seen = draw_tables(cameras, posts(), SIDE, np.random.default_rng(seed))
    # Cells of a layer of 64 whose lower faces lie on the first post's table: z = -0.375
    places, _ = projected(projection(Cameras(*(part[:, 0] for part in cameras)), SIDE), 64)
    layer = places.unflatten(1, (64, 64, 64))[:, 10:54:4, 10:54:4, 7:9].mean(dim=3).flatten(1, 2)
    looked_up = torch.nn.functional.grid_sample(seen[:, 0], layer[:, None], align_corners=False)
    differences = (looked_up[1:, :, 0] - looked_up[:1, :, 0]).abs()
    assert differences.median() < 0.03


def test_shadows_are_one_connected_share_of_a_table_without_which_it_is_lighter():
    cameras, rng = seen_from(0.9), np.random.default_rng
    with_post = draw_tables(cameras, posts(), SIDE, rng(5))
    low = posts()
    low[..., 10:] = 0
    low[1, 28:36, 28:36, 16:18] = 1
    without = draw_tables(cameras, low, SIDE, rng(5))
    assert_close(with_post[:, :, 3], without[:, :, 3])
    assert (with_post[:, :, :3] <= without[:, :, :3] + 1e-4).float().mean() > 0.97
    assert (with_post[:, :, :3] < without[:, :, :3] - 0.02).any()


@pytest.mark.slow
def test_most_tables_have_two_colors_and_some_have_spots_of_all():
    count = 60
    cameras = Cameras(*(part[:1, :1].expand(1, count, *part.shape[2:])
                        for part in seen_from(1.2)))
    low = torch.zeros(count, 64, 64, 64)
    low[:, 32, 32, 0] = 1  # hardly a shadow
    seen = draw_tables(cameras, low, SIDE, np.random.default_rng(7))[0]
    of_all = 0
    for table in seen:
        colors = table[:3, table[3] > 0].T.double()
        spread = torch.linalg.svdvals(colors - colors.mean(dim=0))
        of_all += int(spread[1] > 0.3 * spread[0])
    assert 0.05 * count <= of_all <= 0.3 * count  # 15 % of them
