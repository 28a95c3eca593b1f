"""The parameters of each node, by its name."""

from active_recon.parameters.camera import CameraParameters
from active_recon.parameters.player import PlayerParameters
from active_recon.parameters.reconstructor import ReconstructorParameters
from active_recon.parameters.recorder import RecorderParameters
from active_recon.parameters.turntable_camera import TurntableCameraParameters
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.parameters.viewer import ViewerParameters

NODE_PARAMETERS: dict[str, type] = {
    'reconstructor': ReconstructorParameters, 'view_planner': ViewPlannerParameters,
    'turntable_camera': TurntableCameraParameters, 'camera': CameraParameters,
    'recorder': RecorderParameters, 'viewer': ViewerParameters, 'player': PlayerParameters}
