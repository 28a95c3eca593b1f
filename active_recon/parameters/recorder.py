"""The parameters of the recorder."""

from dataclasses import dataclass

from active_recon.parameters.declaration import parameter

DIAGNOSTICS = '/diagnostics'
TOPICS = ('camera/image_raw', 'camera/image_raw/compressed', 'camera/camera_info', 'camera/pose',
          'camera/mask', 'camera/depth/image_raw', 'camera/depth/image_raw/compressedDepth',
          'camera/depth/camera_info', 'view', 'view_image', 'occupancy', 'probabilities', 'latent',
          'entropy', 'quality', 'episode', 'next_view', 'next_azimuth', 'azimuth_scores',
          'goal_reason', 'done', DIAGNOSTICS)


@dataclass(frozen=True)
class RecorderParameters:
    """Parameters of the recorder."""

    output_dir: str = parameter(
        'bags', 'folder in which each recording creates its own', path=True)
    record_at_start: bool = parameter(True, 'whether to record from the start')
    stop_when_done: bool = parameter(
        False, 'whether a recording ends when an episode is done')
    topics: tuple[str, ...] = parameter(TOPICS, 'topics to record')
    max_bag_size_mb: int = parameter(
        1000, 'largest size of a file, MB; a longer recording is split', low=1, high=1_000_000)
