"""Voxel grids to and from PointCloud2: one point for each cell above a threshold."""

from active_recon.voxels import grid_from_points, VoxelGrid
from msg_tools.clouds import cloud_from_msg, cloud_to_msg
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

FIELDS = ('x', 'y', 'z', 'occupancy')
FLOOR = 0.02
"""Cells of less occupancy are left out of `probabilities`."""


def voxel_grid_from_msg(msg: PointCloud2, size: float = 1.0) -> VoxelGrid:
    """
    Return the grid whose cells the points name; cells without a point are 0.

    `size` is the grid's side in metres. Raises MessageError on a cloud of other fields, DataError
    on points outside the grid.
    """
    return grid_from_points(cloud_from_msg(msg, FIELDS), size)


def voxel_grid_to_msg(grid: VoxelGrid, threshold: float, header: Header) -> PointCloud2:
    """Return the cells above the threshold: x, y, z in metres, occupancy in [0, 1]."""
    return cloud_to_msg(grid.points(threshold), FIELDS, header)
