"""Which node has which parameters."""

from active_recon.nodes.settings.player import PlayerSettings
from active_recon.nodes.settings.reconstructor import ReconstructorSettings
from active_recon.nodes.settings.recorder import RecorderSettings
from active_recon.nodes.settings.turntable_camera import TurntableCameraSettings
from active_recon.nodes.settings.view_planner import ViewPlannerSettings
from active_recon.nodes.settings.viewer import ViewerSettings

SETTINGS: dict[str, type] = {
    'reconstructor': ReconstructorSettings, 'view_planner': ViewPlannerSettings,
    'turntable_camera': TurntableCameraSettings, 'recorder': RecorderSettings,
    'viewer': ViewerSettings, 'player': PlayerSettings}
