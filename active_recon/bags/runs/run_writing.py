"""Writing a run as a bag with the loop's topics: the inverse of reading one."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedRun
from active_recon.bags.storage.atomic_bag import atomic_bag, write_message
from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.geometry.cameras import OBJECT_FRAME
from msg_tools.episodes import done_to_msg, Episode, episode_to_msg
from msg_tools.loop import depth_to_msgs, goal_to_msgs, image_to_msgs, view_to_msgs

_UNNAMED = 'unnamed'  # messages need an id, runs without recorded episodes have none
_LATCHED = QosProfile(durability='transient_local')
_STREAM = QosProfile()


def write_run(run: RecordedRun, folder: Path) -> None:
    """
    Write a run as a new bag, atomically.

    Poses and clouds are in the run's own `object_frame`. Messages without a receive time get
    their stamp. They are published when they are received, since stamps do not tell their order:
    an image may be older than the goal that it reaches. Raises RecordingError if the folder
    exists or the disk is full.
    """
    with atomic_bag(folder) as bag:
        _write(run, bag)


def _write(run: RecordedRun, bag: BagWriter) -> None:
    bag.add_provenance(run.provenance)
    for node, parameters in run.parameters.items():
        bag.attach_parameters(node, parameters)
    frame = node_parameters(run, 'reconstructor').get('object_frame', OBJECT_FRAME)
    messages = (found for episode in run.episodes for found in _messages(episode, frame))
    for received, topic, msg in sorted(messages, key=lambda found: found[0]):
        qos = _STREAM if topic.startswith('camera/') else _LATCHED
        write_message(bag, f'/{topic}', msg, received, received, qos)


def _messages(episode: RecordedEpisode, frame: str) -> Iterator[tuple[int, str, Any]]:
    """Yield receive time, topic and message."""
    received = episode.begin
    for message in _of_views(episode, frame):
        received = max(received, message[0])
        yield message
    if episode.done and not any(map(episode.done_after, episode.views)):  # not after a view
        goals = (episode.first_goal, *(view.goal for view in episode.views))
        stamp = max([episode.begin, *(view.stamp for view in episode.views),
                     *(goal.final.stamp for goal in goals if goal is not None)])
        yield received, 'done', done_to_msg(stamp + 1, episode.done)


def _of_views(episode: RecordedEpisode, frame: str) -> Iterator[tuple[int, str, Any]]:
    begin = Episode(episode.id or _UNNAMED, episode.begin)
    # Stamps may be a simulation's, where messages are received by the time of day
    goal = () if episode.first_goal is None else (episode.first_goal.received,)
    received = min([*goal, *(time for view in episode.views for time in view.received.values())],
                   default=episode.begin)
    yield received, 'episode', episode_to_msg(begin)
    yield received, 'done', done_to_msg(episode.begin, '')
    yield from _of_goal(episode.first_goal, frame)
    for view in episode.views:
        messages = image_to_msgs(view.stamp, view.image, view.camera, frame) | view_to_msgs(
            view.stamp, view.camera, view.reconstruction, view.occupied, view.latent,
            view.entropy, view.quality, frame)
        if view.depth is not None:
            messages |= depth_to_msgs(view.stamp, view.depth)
        yield from _at(messages, view.stamp, view.received)
        if reason := episode.done_after(view):
            received = max([view.stamp, *view.received.values()])
            yield received, 'done', done_to_msg(view.stamp, reason)
        yield from _of_goal(view.goal, frame)


def _of_goal(recorded: RecordedGoal | None, frame: str) -> Iterator[tuple[int, str, Any]]:
    for goal in () if recorded is None else (recorded, *recorded.replacements):
        scores = None if goal.candidates is None or goal.scores is None else (
            goal.candidates.positions, goal.candidates.azimuths, goal.scores)
        messages = goal_to_msgs(goal.stamp, goal.camera, scores, goal.reason, frame)
        yield from _at(messages, goal.stamp, dict.fromkeys(messages, goal.received))


def _at(messages: Mapping[str, Any], stamp: int,
        received: Mapping[str, int]) -> Iterator[tuple[int, str, Any]]:
    for topic, msg in messages.items():
        yield received.get(topic, stamp), topic, msg
