"""Voxels, episodes and stamps between ROS and the core."""

from active_recon.errors import DataError, MessageError
from active_recon.volumes.point_grids import grid_from_points
from active_recon.volumes.voxels import PUBLISHED_FLOOR, VoxelGrid
from msg_tools.clouds import cloud_from_msg, cloud_to_msg
from msg_tools.episodes import (
    done_from_msg,
    done_to_msg,
    Episode,
    episode_from_msg,
    episode_to_msg,
)
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_from_msg, voxel_grid_to_msg
import numpy as np
import pytest
from sensor_msgs.msg import PointField
from std_msgs.msg import Header

GRID = VoxelGrid(np.random.default_rng(0).random((32, 32, 32), np.float32), size=0.4)


@pytest.mark.parametrize('threshold', [0.0, PUBLISHED_FLOOR, 0.5, 1.0])
def test_the_cells_above_the_threshold_come_back(threshold):
    msg = voxel_grid_to_msg(GRID, threshold, Header(frame_id='object'))
    assert msg.width == GRID.occupied(threshold).sum()
    expected = np.where(GRID.occupied(threshold), GRID.occupancy, 0)
    np.testing.assert_array_equal(voxel_grid_from_msg(msg, 0.4).occupancy, expected)


def test_a_cloud_of_64_cells_a_side_is_read_as_such():
    fine = VoxelGrid(np.random.default_rng(1).random((64, 64, 64), np.float32), size=0.4)
    for threshold in (0.0, 0.99999):
        msg = voxel_grid_to_msg(fine, threshold, Header())
        np.testing.assert_array_equal(
            voxel_grid_from_msg(msg, 0.4).occupancy, fine.above(threshold).occupancy)


def test_the_points_of_a_cloud_may_be_in_any_order_but_each_only_once():
    points, rng = GRID.points(0.5), np.random.default_rng(2)
    for several in (points, points[::-1], rng.permutation(points)):
        np.testing.assert_array_equal(
            grid_from_points(several, 0.4).occupancy, GRID.above(0.5).occupancy)
        with pytest.raises(DataError, match='several points in a cell'):
            grid_from_points(np.concatenate([several, several[7:8]]), 0.4)
    with pytest.raises(DataError, match='several points in a cell'):
        grid_from_points(points.repeat(2, axis=0), 0.4)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize('column', range(4))
def test_a_point_with_a_number_that_is_not_finite_is_refused(column, value):
    points = GRID.points(0.5)
    points[3, column] = value
    with pytest.raises(DataError, match='out of the cube|invalid occupancy'):
        grid_from_points(points, 0.4)


def test_a_cloud_without_points_says_nothing_of_its_cells():
    msg = voxel_grid_to_msg(GRID, 1.0, Header())
    assert voxel_grid_from_msg(msg, 0.4).occupancy.shape == (32, 32, 32)
    assert voxel_grid_from_msg(msg, 0.4, resolution=64).occupancy.shape == (64, 64, 64)


def test_points_outside_the_grid_or_between_its_cells_are_refused():
    msg = voxel_grid_to_msg(GRID, 0.5, Header())
    for size, said in ((0.1, 'inside a cube of 0.1 m'),
                       (0.3 * 2 ** 0.5, 'at the centres of'), (0.41, '5 of 164 a side apart')):
        with pytest.raises(MessageError, match=said) as caught:
            voxel_grid_from_msg(msg, size)
        assert caught.value.kind == 'cloud'


def test_a_cloud_is_read_by_the_names_of_its_fields():
    table = np.arange(12, dtype=np.float32).reshape(3, 4)
    msg = cloud_to_msg(table, 'abcd', Header())
    np.testing.assert_array_equal(cloud_from_msg(msg, 'db'), table[:, [3, 1]])


def test_the_gaps_between_the_rows_of_an_ordered_cloud_are_no_points():
    table = np.arange(24, dtype=np.float32).reshape(6, 4)
    msg = cloud_to_msg(table, 'abcd', Header())
    padded = np.pad(table.reshape(2, 12), ((0, 0), (0, 4)), constant_values=99)
    msg.height, msg.width, msg.row_step, msg.data = 2, 3, 64, padded.tobytes()
    np.testing.assert_array_equal(cloud_from_msg(msg, 'abcd'), table)
    np.testing.assert_array_equal(cloud_from_msg(msg, 'ca'), table[:, [2, 0]])
    msg.data = padded.tobytes()[:96]
    with pytest.raises(MessageError, match='expected 128 bytes for 6 points, got 96'):
        cloud_from_msg(msg, 'abcd')


def test_a_cloud_that_lacks_fields_or_bytes_is_refused():
    msg = cloud_to_msg(np.zeros((3, 2), np.float32), 'ab', Header())
    with pytest.raises(MessageError, match='fields a, z, got none named z'):
        cloud_from_msg(msg, 'az')
    msg.width = 4
    with pytest.raises(MessageError, match='expected 32 bytes for 4 points, got 24'):
        cloud_from_msg(msg, 'ab')


def test_a_cloud_of_other_numbers_is_refused_by_what_they_are():
    msg = cloud_to_msg(np.zeros((3, 4), np.float32), ('x', 'y', 'z', 'w'), Header())
    for field, datatype in zip(msg.fields, (PointField.FLOAT64, PointField.UINT16, 77),
                               strict=False):
        field.datatype = datatype
    with pytest.raises(MessageError, match='expected float32 fields x, y, z, occupancy, got x in '
                                           'float64, y in uint16, z in 77, none named occupancy$'):
        voxel_grid_from_msg(msg)


@pytest.mark.parametrize('nanoseconds', [0, 1, 999_999_999, 10**9, 1_795_000_000_123_456_789])
def test_a_stamp_comes_back_to_the_nanosecond(nanoseconds):
    assert nanoseconds_from_stamp(stamp_from_nanoseconds(nanoseconds)) == nanoseconds


def test_an_episode_and_its_end_come_back_as_they_were():
    episode = Episode('ab12', 5_000_000_001)
    assert episode_from_msg(episode_to_msg(episode)) == episode
    assert done_from_msg(done_to_msg(7, 'max_views')) == (7, 'max_views')
    with pytest.raises(MessageError, match='unique id'):
        episode_from_msg(Header())
