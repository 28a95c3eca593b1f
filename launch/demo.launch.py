"""The loop on a simulated turntable, recorded; `--show-args` lists the arguments."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare('active_recon')
ARGUMENTS = {
    'namespace': ('', 'namespace of the nodes and their topics'),
    'params_file': (
        PathJoinSubstitution([SHARE, 'config', 'demo.yaml']), 'parameters file of the nodes'),
    'use_sim_time': ('false', 'whether to use the time on /clock, unless params_file tells'),
    'autostart': ('true', 'whether reconstructor and view planner activate themselves, unless '
                  'params_file tells'),
    'single_process': ('false', 'whether reconstructor and view planner share a process'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
}


def generate_launch_description():
    value = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, (default, description) in ARGUMENTS.items()),
        Node(package='active_recon', executable='turntable_camera', name='turntable_camera',
             namespace=value['namespace'], output='screen',
             parameters=[{
                 'use_sim_time': ParameterValue(value['use_sim_time'], value_type=bool)},
                 value['params_file']],
             arguments=['--ros-args', '--log-level', value['log_level']]),
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(
                PathJoinSubstitution([SHARE, 'launch', 'reconstruction.launch.py'])),
            launch_arguments=value.items()),
    ])
