"""Any bag read into a run: the views that the loop took, or those that it would take."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from active_recon.bags.camera_stream import CameraStream
from active_recon.bags.image_gaps import gaps_between, ImageGaps, unheard_images
from active_recon.bags.loop_record import LoopRecord
from active_recon.bags.raw import Bag, BagSummary
from active_recon.bags.recorded_views import gated_views, recorded_episodes
from active_recon.bags.run import RecordedEpisode, RecordedRun
from active_recon.bags.storage import open_bag
from active_recon.bags.topics import camera_topics, loop_namespace, Topics
from active_recon.errors import ActiveReconError, DataError
from active_recon.reporting import Reporting, silent
from active_recon.view_gate import ViewGate

_FOUND = Topics()
Value = TypeVar('Value', float, str)


def read_run(path: Path, topics: Topics = _FOUND, reporting: Reporting = silent) -> RecordedRun:
    """
    Read a bag of ours or of others: an MCAP or sqlite3 file, or a rosbag2 folder.

    Where the loop's `view` topic is there it says which images were views; otherwise the gate of
    the reconstructor's node does. Raises DataError that says what is wrong or missing.
    """
    bag = open_bag(path)
    return run_in(bag, bag.summary(reporting), path, topics, reporting)


def run_in(bag: Bag, summary: BagSummary, path: Path, topics: Topics,
           reporting: Reporting) -> RecordedRun:
    """Return the run in an open bag, as `read_run` does."""
    try:
        episodes, counters, gaps = _episodes(bag, summary, topics, reporting)
    except ActiveReconError as error:
        told = str(error)
        raise DataError(told if told.startswith(str(path)) else f'{path}: {told}',
                        error.kind) from error
    return RecordedRun(path, episodes, summary.provenance, summary.parameters, counters,
                       summary.topics, summary.begin, summary.end, gaps)


def _episodes(bag: Bag, summary: BagSummary, topics: Topics, reporting: Reporting
              ) -> tuple[list[RecordedEpisode], Mapping[str, Mapping[str, int]], ImageGaps]:
    """Return the episodes, the counters by node, and what is missing of the images."""
    namespace = None if topics.azimuth else loop_namespace(summary.topics)
    node = summary.parameters.get(f'{namespace or "/"}reconstructor'.strip('/'), {})
    topics = replace(topics, max_pose_gap=_value(node, 'max_pose_gap', topics.max_pose_gap),
                     object_frame=_value(node, 'object_frame', topics.object_frame))
    stream = CameraStream(bag, camera_topics(summary.topics, topics), topics, reporting)
    if namespace is None:
        episode, counters = gated_views(stream, ViewGate())
        return [episode], {'bag': counters}, gaps_between([stamp for stamp, _ in stream.images])
    record = LoopRecord(
        bag, namespace, _value(node, 'object_size', 1.0), topics.object_frame)
    episodes = recorded_episodes(stream, record)
    gaps = gaps_between([stamp for stamp, _ in stream.images])
    unheard = unheard_images([received for _, received in stream.images], record.counted.get(
        f'{namespace}reconstructor'.strip('/'), ()))
    return episodes, record.counters, replace(gaps, unheard=unheard)


def _value(parameters: Mapping[str, Any], name: str, default: Value) -> Value:
    """Return a recorded parameter; DataError where it is of another type than the default."""
    value = parameters.get(name, default)
    if isinstance(default, float) and type(value) is int:
        value = float(value)
    if not isinstance(value, type(default)):
        raise DataError(f'parameter {name}: expected a {type(default).__name__}, got {value!r}')
    return value
