"""Reconstructor, view planner and recorder for a camera of yours; see `--show-args`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    'namespace': ('', 'the namespace of the nodes and of all their topics'),
    'params_file': (
        PathJoinSubstitution([FindPackageShare('active_recon'), 'config', 'arm.yaml']),
        "the nodes' parameters"),
    'use_sim_time': ('false', 'whether the time is that of /clock'),
    'autostart': ('true', 'whether the nodes configure and activate themselves'),
    'record': ('true', 'whether to record a bag'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
    'image': ('camera/image_raw', "the camera's images"),
    'camera_info': ('camera/camera_info', "the camera's calibration"),
    'pose': ('camera/pose', "the camera's pose in the object's frame"),
}


def generate_launch_description():
    value = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    shared = {
        'package': 'active_recon',
        'namespace': value['namespace'],
        'remappings': [('camera/image_raw', value['image']),
                       ('camera/camera_info', value['camera_info']),
                       ('camera/pose', value['pose'])],
        'arguments': ['--ros-args', '--log-level', value['log_level']],
        'output': 'screen',
    }
    parameters = [value['params_file'], {
        'use_sim_time': ParameterValue(value['use_sim_time'], value_type=bool)}]
    managed = [*parameters, {'autostart': ParameterValue(value['autostart'], value_type=bool)}]
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, (default, description) in ARGUMENTS.items()),
        Node(executable='reconstructor', name='reconstructor', parameters=managed, **shared),
        Node(executable='view_planner', name='view_planner', parameters=managed, **shared),
        Node(executable='recorder', name='recorder', parameters=parameters,
             condition=IfCondition(value['record']), **shared),
    ])
