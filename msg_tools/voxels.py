"""Voxel grids to and from PointCloud2: one point for each cell above a threshold."""

from active_recon.errors import DataError, MessageError
from active_recon.volumes.point_grids import grid_from_points
from active_recon.volumes.voxels import RESOLUTION, VoxelGrid
from msg_tools.clouds import cloud_from_msg, cloud_to_msg
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

FIELDS = ('x', 'y', 'z', 'occupancy')


def voxel_grid_from_msg(msg: PointCloud2, size: float = 1.0,
                        resolution: int = RESOLUTION) -> VoxelGrid:
    """
    Return the grid with the cells in a cloud; cells without a point are 0.

    `size` is the grid's side in metres. The resolution follows from the points; `resolution`,
    cells a side, is that of a cloud without points. Raises MessageError of the kind 'cloud' on
    other fields, and on points that are not cells of one grid.
    """
    points = cloud_from_msg(msg, FIELDS)
    try:
        return grid_from_points(points, size, resolution)
    except DataError as error:
        raise MessageError(str(error), 'cloud') from error


def voxel_grid_to_msg(grid: VoxelGrid, threshold: float, header: Header) -> PointCloud2:
    """Return the cells above the threshold: x, y, z in metres, occupancy in [0, 1]."""
    return cloud_to_msg(grid.points(threshold), FIELDS, header)
