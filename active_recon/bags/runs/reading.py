"""Reading any bag into a run: the views that the loop took, or those that it would take."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from active_recon.acquisition.view_gate import ViewGate
from active_recon.bags.runs.camera_stream import CameraStream
from active_recon.bags.runs.image_gaps import gaps_between, ImageGaps, uncounted_images
from active_recon.bags.runs.loop_record import LoopRecord
from active_recon.bags.runs.parameters import parameters_among
from active_recon.bags.runs.recorded_depth import with_depth, with_depth_of
from active_recon.bags.runs.recorded_views import gated_views, recorded_episodes
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topic_search import camera_topics
from active_recon.bags.runs.topics import loop_topics, POSE_TYPES, Topics
from active_recon.bags.storage.bag import Bag, BagSummary
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ActiveReconError, ConfigError, DataError
from active_recon.reporting import Reporting, silent

_ANY_TOPICS = Topics()
_RECORDED_SCENE = Scene()


@dataclass(frozen=True, eq=False)
class _Read:
    """What was read: episodes, counters by node, missing images, assumptions."""

    episodes: Sequence[RecordedEpisode]
    counters: Mapping[str, Mapping[str, int]]
    gaps: ImageGaps
    assumed: Sequence[str]


def read_run(path: Path, topics: Topics = _ANY_TOPICS, scene: Scene = _RECORDED_SCENE,
             reporting: Reporting = silent) -> RecordedRun:
    """
    Read any bag, recorded by this package or not: an MCAP or sqlite3 file, or a rosbag2 folder.

    If the bag has the loop's topic `view`, this determines which images were views; otherwise the
    view gate of the reconstructor's node does. `scene` holds what the bag does not. Raises
    DataError that says what is wrong or missing, ConfigError if `scene` repeats what the bag has.
    """
    bag = open_bag(path)
    return run_in(bag, bag.summary(reporting), path, topics, scene, reporting)


def run_in(bag: Bag, summary: BagSummary, path: Path, topics: Topics, scene: Scene,
           reporting: Reporting) -> RecordedRun:
    """Return the run in an open bag, as `read_run` does."""
    try:
        read = _read(bag, summary, topics, scene, reporting)
    except ConfigError:
        raise
    except ActiveReconError as error:
        reason = str(error)
        raise DataError(reason if reason.startswith(str(path)) else f'{path}: {reason}',
                        error.kind) from error
    return RecordedRun(path, read.episodes, summary.provenance, summary.parameters, read.counters,
                       summary.topics, summary.begin, summary.end, read.gaps, read.assumed)


def _read(bag: Bag, summary: BagSummary, topics: Topics, scene: Scene,
          reporting: Reporting) -> _Read:
    loop = None if topics.azimuth else loop_topics(summary)
    for option, given in (('--object-position', scene.object_position is not None),
                          ('--depth', topics.depth)):
        if given and loop is not None:
            raise ConfigError(f'{option}: not needed: the bag has the views of a loop, which knew '
                              'that')
    node = parameters_among(summary.parameters, 'reconstructor')
    frame_given = topics.object_frame != _ANY_TOPICS.object_frame
    for name in ('object_frame', 'max_pose_gap'):
        given = getattr(topics, name)
        recorded = node.get(name, given)
        if given == getattr(_ANY_TOPICS, name):
            topics = replace(topics, **{name: recorded})
        elif loop is not None and given != recorded:
            raise ConfigError(f'--{name.replace("_", "-")}: not needed: the bag has that of its '
                              f'loop, {recorded}')
    scene = replace(scene, object_size=scene.object_size or {
        **parameters_among(summary.parameters, 'turntable_camera'), **node}.get('object_size'))
    camera = camera_topics(bag, summary, topics)
    if frame_given and camera.azimuth.type_name not in POSE_TYPES:
        raise ConfigError(f'--object-frame: not for {camera.azimuth.type_name}, which the bag has '
                          f'on {camera.azimuth.name}{camera.advice}')
    stream = CameraStream(bag, camera, topics, scene, reporting)
    if loop is None:
        episode, counters = gated_views(stream, ViewGate(), scene)
        if camera.depth:
            if stream.assumed:
                raise ConfigError("--depth needs the camera's pose and lens: expected them in the "
                                  f'bag, which lacks {"; ".join(stream.assumed)}')
            episode = with_depth_of(camera.depth, episode, bag, stream)
        gaps = _gaps(stream)
        return _Read([episode], {'bag': counters}, gaps, _assumed(stream, scene))
    record = LoopRecord(bag, loop, node.get('object_size', scene.size), topics.object_frame,
                        summary.parameters)
    episodes = with_depth(recorded_episodes(stream, record, scene), bag, loop.namespace,
                          summary.provenance, node)
    if camera.of_views:  # the images between the views were not recorded
        return _Read(episodes, record.counters, ImageGaps(), _assumed(stream, scene))
    gaps = _gaps(stream)
    uncounted = uncounted_images([received for _, received in stream.images], record.counted.get(
        f'{loop.namespace}reconstructor'.strip('/'), ()))
    return _Read(episodes, record.counters, replace(gaps, uncounted=uncounted),
                 _assumed(stream, scene))


def _gaps(stream: CameraStream) -> ImageGaps:
    stamped = [times for times in stream.images if times[0]]  # none before a simulation's clock
    return gaps_between([stamp for stamp, _ in stamped], [received for _, received in stamped])


def _assumed(stream: CameraStream, scene: Scene) -> list[str]:
    size = [] if scene.object_size else [
        f"the object's cube has a side of {scene.size:g} m (--object-size)"]
    return [*size, *stream.assumed]

