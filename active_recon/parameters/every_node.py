"""Which node has which parameters."""

from active_recon.parameters.player import PlayerSettings
from active_recon.parameters.reconstructor import ReconstructorSettings
from active_recon.parameters.recorder import RecorderSettings
from active_recon.parameters.turntable_camera import TurntableCameraSettings
from active_recon.parameters.view_planner import ViewPlannerSettings
from active_recon.parameters.viewer import ViewerSettings

SETTINGS: dict[str, type] = {
    'reconstructor': ReconstructorSettings, 'view_planner': ViewPlannerSettings,
    'turntable_camera': TurntableCameraSettings, 'recorder': RecorderSettings,
    'viewer': ViewerSettings, 'player': PlayerSettings}
