"""Any bag read into a run: the views that the loop took, or those that it would take."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from active_recon.acquisition.view_gate import ViewGate
from active_recon.bags.runs.camera_stream import CameraStream
from active_recon.bags.runs.image_gaps import gaps_between, ImageGaps, unheard_images
from active_recon.bags.runs.loop_record import LoopRecord
from active_recon.bags.runs.recorded_views import gated_views, recorded_episodes
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import camera_topics, loop_namespace, Topics
from active_recon.bags.storage.opening import open_bag
from active_recon.bags.storage.raw import Bag, BagSummary
from active_recon.errors import ActiveReconError, ConfigError, DataError
from active_recon.reporting import Reporting, silent

_FOUND = Topics()
_NOTHING_TOLD = Scene()
Value = TypeVar('Value', float, str)


@dataclass(frozen=True, eq=False)
class _Read:
    """The episodes, the counters by node, what is missing of the images, what was assumed."""

    episodes: Sequence[RecordedEpisode]
    counters: Mapping[str, Mapping[str, int]]
    gaps: ImageGaps
    assumed: Sequence[str]


def read_run(path: Path, topics: Topics = _FOUND, scene: Scene = _NOTHING_TOLD,
             reporting: Reporting = silent) -> RecordedRun:
    """
    Read a bag of ours or of others: an MCAP or sqlite3 file, or a rosbag2 folder.

    Where the loop's `view` topic is there it says which images were views; otherwise the gate of
    the reconstructor's node does. `scene` is what the bag does not tell of it. Raises DataError
    that says what is wrong or missing, ConfigError where the scene tells what the bag does.
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
        told = str(error)
        raise DataError(told if told.startswith(str(path)) else f'{path}: {told}',
                        error.kind) from error
    return RecordedRun(path, read.episodes, summary.provenance, summary.parameters, read.counters,
                       summary.topics, summary.begin, summary.end, read.gaps, read.assumed)


def _read(bag: Bag, summary: BagSummary, topics: Topics, scene: Scene,
          reporting: Reporting) -> _Read:
    namespace = None if topics.azimuth else loop_namespace(summary.topics)
    node = summary.parameters.get(f'{namespace or "/"}reconstructor'.strip('/'), {})
    topics = replace(topics, max_pose_gap=_value(node, 'max_pose_gap', topics.max_pose_gap),
                     object_frame=_value(node, 'object_frame', topics.object_frame))
    told = scene.object_size or _value(
        {**_simulated(summary), **node}, 'object_size', 0.0)
    scene = replace(scene, object_size=told or None)
    camera = camera_topics(bag, summary, topics)
    stream = CameraStream(bag, camera, topics, scene, reporting)
    if namespace is None:
        episode, counters = gated_views(stream, ViewGate(), scene)
        gaps = gaps_between([stamp for stamp, _ in stream.images])
        return _Read([episode], {'bag': counters}, gaps, _assumed(stream, scene))
    recorded_size = _value(node, 'object_size', scene.size)
    record = LoopRecord(bag, namespace, recorded_size, topics.object_frame)
    episodes = recorded_episodes(stream, record, scene)
    if camera.of_views:  # between them there were images that nobody recorded
        return _Read(episodes, record.counters, ImageGaps(), _assumed(stream, scene))
    gaps = gaps_between([stamp for stamp, _ in stream.images])
    unheard = unheard_images([received for _, received in stream.images], record.counted.get(
        f'{namespace}reconstructor'.strip('/'), ()))
    return _Read(episodes, record.counters, replace(gaps, unheard=unheard),
                 _assumed(stream, scene))


def _simulated(summary: BagSummary) -> Mapping[str, Any]:
    """Return the parameters of the simulated camera, if it was one."""
    return next((values for name, values in summary.parameters.items()
                 if name.rpartition('/')[2] == 'turntable_camera'), {})


def _assumed(stream: CameraStream, scene: Scene) -> list[str]:
    size = [] if scene.object_size else [
        f"the object's cube has a side of {scene.size:g} m (--object-size)"]
    return [*size, *stream.assumed]


def _value(parameters: Mapping[str, Any], name: str, default: Value) -> Value:
    """Return a recorded parameter; DataError where it is of another type than the default."""
    value = parameters.get(name, default)
    if isinstance(default, float) and type(value) is int:
        value = float(value)
    if not isinstance(value, type(default)):
        raise DataError(f'parameter {name} is {value!r}: expected a {type(default).__name__}')
    return value
