"""The views of an episode, and how its policy sees them: from the object's front."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.acquisition.motion import MotionLimits
from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
from active_recon.policies.base import Observation
from active_recon.quality.quality import Quality
from active_recon.volumes.voxels import turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class PlannerView:
    """
    A view and the reconstruction after it, as a policy needs them.

    - latent: (C, h, w), the network's after that view
    - camera: of the view that was really taken, in the object frame
    - entropy: of the reconstruction, nats
    - volume: the published probabilities, for a policy that wants them
    - quality: None where it is not judged
    - earlier: cameras of the views that the episode had before the planner's first
    """

    latent: NDArray[np.float32]
    camera: Camera
    entropy: float
    volume: VoxelGrid | None = None
    quality: Quality | None = None
    earlier: Sequence[Camera] = ()

    def is_of(self, other: 'PlannerView') -> bool:
        """Whether it is the same view, whatever its entropy and quality."""
        return (self.latent is other.latent and self.camera is other.camera
                and self.volume is other.volume)


def observation(views: Sequence[PlannerView], candidates: Sequence[Camera], yaw: float,
                wants_volume: bool, limits: MotionLimits) -> Observation:
    """
    Return what a policy sees after the last of some views of one episode.

    `yaw` is the azimuth of the object's front, radians; `limits` are the camera's. Raises
    ViewError where the policy wants the probabilities and the last view has none.
    """
    last = views[-1]
    if last.volume is None and wants_volume:
        raise ViewError('no probabilities: expected them beside the latent, as this policy '
                        'looks at them, got none', 'volume')
    unit = 1.0 if last.volume is None else 1 / last.volume.size
    taken = policy_poses(cameras_of(views), yaw, unit)
    # Copies: a policy that works in place leaves the reconstruction as it is
    volume = None if last.volume is None else turned(last.volume.occupancy.copy(), -yaw)[None]
    return Observation(
        last.latent[None].copy(), taken[None], policy_poses(candidates, yaw, unit)[None], volume,
        limits.allows([camera.azimuth for camera in candidates]))


def cameras_of(views: Sequence[PlannerView]) -> list[Camera]:
    """Return the cameras of all views of an episode, those before the planner's first, too."""
    return [camera for view in views for camera in (*view.earlier, view.camera)]


def policy_poses(cameras: Sequence[Camera], yaw: float, unit: float) -> NDArray[np.float64]:
    """Return the poses of cameras as an Observation has them, (N, 4, 4): lengths times `unit`."""
    return np.stack([each.turned(-yaw).scaled(unit).pose for each in cameras])
