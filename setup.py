"""The ROS package active_recon, for `pip install .` and `colcon build` alike."""

from glob import glob
import os

from setuptools import find_packages, setup

NAME = 'active_recon'
NODES = ('camera', 'composed', 'reconstructor', 'recorder', 'turntable_camera', 'view_planner',
         'viewer')
EXECUTABLES = {
    'active-recon': f'{NAME}.cli.start', **{node: f'{NAME}.nodes.{node}' for node in NODES}}

# A sourced ROS has rclpy and the messages; the wheels beside it would be a second ROS.
ROS_WHEELS = () if 'ROS_DISTRO' in os.environ else (
    'ros-jazzy-rclpy>=7.1,<8',
    'ros-jazzy-rmw-fastrtps-cpp>=8.4,<9',
    'ros-jazzy-common-interfaces>=5.3,<6',
)

setup(
    name=NAME,
    version='0.1.0',
    description='Active 3D reconstruction of an object from few camera views',
    license='Apache-2.0',
    maintainer='active_recon developers',
    maintainer_email='active-recon@example.com',
    python_requires='>=3.11',
    packages=find_packages(include=[NAME, f'{NAME}.*', 'msg_tools', 'msg_tools.*']),
    package_data={NAME: [
        'weights/*.safetensors', 'weights/*.onnx', 'weights/*.json', 'weights/*.md', 'objects/*',
        'nodes/runtime/*.xml', 'report/templates/*', 'batch/templates/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        # colcon overwrites these with its own; pip installs executables into bin/ alone.
        (f'lib/{NAME}', [f'scripts/{name}' for name in EXECUTABLES]),
        *((f'share/{NAME}/{folder}', files) for folder in ('launch', 'config', 'rviz')
          if (files := sorted(glob(f'{folder}/*')))),
        (f'share/{NAME}/security', ['security/README.md', 'security/policies.xml']),
    ],
    entry_points={'console_scripts': [
        f'{name} = {module}:main' for name, module in EXECUTABLES.items()]},
    install_requires=[
        'embreex>=2.17.7.post6,<5',
        'fsspec>=2025.2,<2028',
        'jinja2>=3.1,<4',
        'lightning-fabric>=2.4,<3',
        'lz4>=4.3,<5',
        'matplotlib>=3.9,<4',
        'mcap>=1.5,<2',
        'numpy>=1.26,<3',
        'opencv-python-headless>=4.11,<6',
        'openvino>=2026.1,<2028',
        'PyYAML>=6,<7',
        'pillow>=11.3,<14',
        'plotly>=6,<8',
        'rich>=13.7,<16',
        'rosbags>=0.11.6,<1',
        'safetensors>=0.4.3,<1',
        'scikit-image>=0.22,<1',
        'scipy>=1.15,<2',
        'tensorboard>=2.16,<3',
        'torch>=2.5,<3',
        'trimesh>=4.9,<6',
        'typer>=0.26,<1',
        'viser>=1.1,<2',
        'websockets>=15,<18',
        'zstandard>=0.22,<1',
        *ROS_WHEELS,
    ],
    extras_require={
        'batch': ['pyarrow>=18,<28'],
        'cluster': ['pyarrow>=18,<28', 'ray[client]>=2.52,<3'],
        'coacd': ['coacd>=1.0.5,<2'],
        'doc': [
            'furo>=2024.8', 'myst-parser>=4', 'sphinx>=8', 'sphinx-autodoc2>=0.5',
            'sphinx-copybutton>=0.5.2'],
        'export': ['onnx>=1.17,<2'],
        'heic': ['pillow-heif>=1.1,<2'],
        'int8': ['nncf>=3,<4', 'onnx>=1.17,<2'],
        'lint': ['mypy>=1.11', 'ruff>=0.6'],
        'onnxruntime': ['onnxruntime>=1.21,<2'],
        's3': ['s3fs>=2025.2'],
        'sfm': ['pycolmap>=4,<5'],
        'test': [
            'coacd>=1.0.5,<2', 'mcap-ros2-support>=0.5.5', 'mujoco>=3.7,<4', 'onnx>=1.17,<2',
            'onnxruntime>=1.21,<2', 'pillow-heif>=1.1,<2', 'point-cloud-utils>=0.34',
            'pyarrow>=18,<28', 'pycolmap>=4,<5', 'pymcap-cli>=0.30', 'pytest>=8',
            'pytest-xdist>=3.6', 'ray[client]>=2.52,<3', 'rosless>=0.5', 'selenium>=4.20',
            'setuptools>=70.1'],
        # A store's server, for the long tests
        'test-full': ['flask>=3,<4', 'flask-cors>=5', 'moto[s3]>=5,<6', 's3fs>=2025.2'],
    },
)
