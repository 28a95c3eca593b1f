"""Reconstructor, planner, recorder, and the camera if asked; `--show-args` lists the arguments."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    'namespace': ('', 'namespace of the nodes and their topics'),
    'params_file': (
        PathJoinSubstitution([FindPackageShare('active_recon'), 'config', 'arm.yaml']),
        'parameters file of the nodes'),
    'use_sim_time': ('false', 'whether to use the time on /clock, unless params_file tells'),
    'autostart': ('true', 'whether the nodes configure and activate themselves, unless '
                  'params_file tells'),
    'single_process': ('false', 'whether reconstructor and view planner share a process'),
    'camera': ('false', 'whether to start the node camera, for a camera without a driver; its '
               'source is in params_file'),
    'record': ('true', 'whether to record a bag'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
    'image': ('camera/image_raw', "topic of the camera's images"),
    'camera_info': ('camera/camera_info', "topic of the camera's calibration"),
    'pose': ('camera/pose', "topic of the camera's pose in the object's frame"),
}


def generate_launch_description():
    value = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    shared = {
        'package': 'active_recon',
        'namespace': value['namespace'],
        'remappings': [('camera/image_raw', value['image']),
                       ('camera/camera_info', value['camera_info']),
                       ('camera/pose', value['pose'])],
        'output': 'screen',
    }
    log_level = ['--ros-args', '--log-level', value['log_level']]
    apart, together = (condition(value['single_process'])
                       for condition in (UnlessCondition, IfCondition))
    # Of a parameter that is given twice the last holds: the file's, not an argument's default
    use_sim_time, autostart = ({name: ParameterValue(value[name], value_type=bool)}
                               for name in ('use_sim_time', 'autostart'))
    parameters = [use_sim_time, value['params_file']]
    managed = [use_sim_time, autostart, value['params_file']]
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, (default, description) in ARGUMENTS.items()),
        Node(executable='reconstructor', name='reconstructor', parameters=managed,
             arguments=log_level, condition=apart, **shared),
        Node(executable='view_planner', name='view_planner', parameters=managed,
             arguments=log_level, condition=apart, **shared),
        # Without a name here: it would be that of both nodes
        Node(executable='composed', parameters=managed,
             arguments=['reconstructor', 'view_planner', *log_level], condition=together,
             **shared),
        Node(executable='camera', name='camera', parameters=managed, arguments=log_level,
             condition=IfCondition(value['camera']), **shared),
        Node(executable='recorder', name='recorder', parameters=parameters, arguments=log_level,
             condition=IfCondition(value['record']), **shared),
    ])
