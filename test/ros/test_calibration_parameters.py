"""ROS reads the parameters that a calibration writes, in any namespace."""

from active_recon.calibration.board import Detection
from active_recon.calibration.fit import ImageFit
from active_recon.calibration.outcome import Calibration
from active_recon.geometry.cameras import CANONICAL_INTRINSICS
from active_recon.parameters.camera_pose import CameraPoseParameters
import numpy as np
import pytest
import rclpy

pytestmark = pytest.mark.ros
PARAMETERS = {'object_size': 0.25, 'pose_source': 'turntable_joint', 'turntable_direction': -1,
              'camera_position': [0.5, 0.0, 1e-06],
              'camera_orientation': [0.5, -0.5, 0.5, 0.5]}


@pytest.mark.parametrize('namespace', ['', '/left/cell'])
def test_ros_reads_what_a_calibration_writes(ros, tmp_path, namespace):
    seen = Detection('a.png', np.zeros((6, 3)), np.zeros((6, 2)), (137, 137))
    calibration = Calibration(
        CANONICAL_INTRINSICS, [ImageFit(seen, seen.pixels, np.eye(4))], np.eye(4), 0.25,
        {'reconstructor': PARAMETERS, 'view_planner': {'object_size': 0.3}}, ['One remark.'], {})
    path = tmp_path / 'calibration.yaml'
    path.write_text(calibration.as_yaml())
    node = rclpy.create_node(
        'reconstructor', namespace=namespace, automatically_declare_parameters_from_overrides=True,
        cli_args=['--ros-args', '--params-file', str(path)])
    try:
        given = {name: node.get_parameter(name).value for name in PARAMETERS}
    finally:
        node.destroy_node()
    lists = {name: list(value) for name, value in given.items() if name.startswith('camera_')}
    assert {**given, **lists} == PARAMETERS
    names = given.keys() - {'object_size'}
    CameraPoseParameters(**{name: given[name] for name in names}).as_fixed_camera()
