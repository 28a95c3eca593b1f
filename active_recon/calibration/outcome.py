"""The result of a calibration, and its files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from active_recon.calibration.files import read_image
from active_recon.calibration.fit import ImageFit, overall_error
from active_recon.calibration.lens import write_lens
from active_recon.calibration.picture import picture_of
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
from active_recon.png_files import write_png
from active_recon.whole_files import whole_file
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
import yaml


@dataclass(frozen=True, eq=False)
class Calibration:
    """
    The result of a calibration.

    - lens: the lens parameters; images: the fit of each image
    - board_from_object: pose of the object frame on the board, at table angle 0, (4, 4), metres
    - object_size: side of the object's cube, metres
    - parameters: parameters for each node, by the node's name
    - remarks: warnings about the result, one line each
    - transforms: static tf transforms, (parent, child) to a pose (4, 4)
    """

    lens: Intrinsics
    images: list[ImageFit]
    board_from_object: NDArray[np.float64]
    object_size: float
    parameters: Mapping[str, Mapping[str, Any]]
    remarks: list[str]
    transforms: Mapping[tuple[str, str], NDArray[np.float64]]

    @property
    def error(self) -> float:
        """Root mean square distance over all corners of all images, pixels."""
        return overall_error(self.images)

    def save(self, folder: Path, paths: Sequence[Path]) -> None:
        """
        Write calibration.yaml, calibration.png and camera_info.yaml to a folder.

        `paths` are the images' files. Raises DataError where the folder cannot be written.
        """
        by_name = {path.name: path for path in paths}
        picture = picture_of(self.images, self.lens, self.board_from_object, self.object_size,
                             lambda name: read_image(by_name[name]))
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with whole_file(folder / 'calibration.yaml') as unfinished:
                unfinished.write_text(self.as_yaml())
            write_lens(self.lens, folder / 'camera_info.yaml')
            write_png(folder / 'calibration.png', picture)
        except OSError as error:
            raise DataError(f'{folder}: calibration not written: expected a writable folder, got: '
                            f'{error}') from error

    def as_yaml(self) -> str:
        """Return the parameters as a ROS parameters file."""
        nodes = {f'/**/{node}': {'ros__parameters': dict(parameters)}
                 for node, parameters in self.parameters.items()}
        head = [f'Calibrated from {len(self.images)} images, reprojection error '
                f'{self.error:.2f} pixels (RMS).', *self.remarks, *self.static_transforms()]
        written: str = yaml.safe_dump(nodes, sort_keys=False, default_flow_style=None)
        return ''.join(f'# {line}\n' for line in head) + written

    def static_transforms(self) -> list[str]:
        """Return the commands that publish the transforms."""
        return [
            'ros2 run tf2_ros static_transform_publisher '
            + ' '.join(f'--{name} {value:.6f}' for name, value in zip(
                ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'),
                (*pose[:3, 3], *quaternion_of(pose)), strict=True))
            + f' --frame-id {parent} --child-frame-id {child}'
            for (parent, child), pose in self.transforms.items()]


def quaternion_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit quaternion x, y, z, w of a pose (4, 4), (4,), with w at least 0."""
    quaternion = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return np.asarray(quaternion * (np.sign(quaternion[3]) or 1.0))
