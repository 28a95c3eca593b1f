"""The parameters of the recorder."""

from dataclasses import dataclass

from active_recon.parameters.declaration import parameter

DIAGNOSTICS = '/diagnostics'
TOPICS = ('camera/image_raw', 'camera/image_raw/compressed', 'camera/camera_info', 'camera/pose',
          'camera/mask', 'view', 'view_image', 'occupancy', 'probabilities', 'latent', 'entropy',
          'episode', 'next_view', 'next_azimuth', 'azimuth_scores', 'done', DIAGNOSTICS)


@dataclass(frozen=True)
class RecorderSettings:
    """What the recorder is told."""

    output_dir: str = parameter('bags', 'the folder in which each recording gets its own')
    record_at_start: bool = parameter(True, 'whether to record without being asked')
    stop_when_done: bool = parameter(
        False, 'whether a recording ends by itself once an episode is done')
    topics: tuple[str, ...] = parameter(TOPICS, 'the topics to record')
    max_bag_size_mb: int = parameter(
        1000, 'a longer recording goes on in a second file, a third, ...', low=1, high=1_000_000)
