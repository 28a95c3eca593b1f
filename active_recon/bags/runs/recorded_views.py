"""The views in a bag: those that the loop took, or those that its view gate accepts."""

from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
import math
from typing import Any

from active_recon.acquisition.view_gate import ViewGate
from active_recon.bags.runs.camera_stream import CameraStream
from active_recon.bags.runs.loop_record import LoopRecord
from active_recon.bags.runs.run import RecordedEpisode, RecordedGoal, RecordedView
from active_recon.bags.runs.scene import Scene
from active_recon.errors import DataError, MessageError, ViewError
from active_recon.geometry.cameras import azimuth_difference, Camera, OrbitCamera
from active_recon.geometry.view_distance import view_distance
from msg_tools.episodes import Episode
from msg_tools.views import NOT_BEGUN, View
import numpy as np

_ROUNDING = 1e-9  # rad
_SAME_POSE = 1e-3  # metres, and parts of unit vectors


def recorded_episodes(stream: CameraStream, record: LoopRecord,
                      scene: Scene) -> list[RecordedEpisode]:
    """
    Return the recorded episodes, each with its views in the order in which they were taken.

    Views before the first episode form one without an id. Views from before the recording, known
    from latched messages, are left out. The background is removed as the scene says, unless the
    loop did so. What is occupied when an episode begins tells that it goes on from a saved state.
    Raises DataError if the image or the camera of another view is missing, ViewError if the object
    is not found in an image.
    """
    stamps = sorted(record.parts['view'])
    views = _taken_views(stream, record, stamps)
    before = set(stamps) - {view.stamp for view in views}
    resumed = record.parts['occupancy'].keys() - stamps
    begun: list[Episode] = sorted(record.parts['episode'].values(), key=lambda each: each.begin)
    if views and (not begun or views[0].stamp < begun[0].begin):
        begun.insert(0, Episode('', views[0].stamp))
    ends = [episode.begin for episode in begun[1:]] + [math.inf]
    return [replace(
        _episode(episode, [view for view in views if episode.begin <= view.stamp < end],
                 end, stream, record, scene),
        begun_before=episode.begin in resumed or any(
            episode.begin <= stamp < end for stamp in before))
        for episode, end in zip(begun, ends, strict=True)]


def gated_views(stream: CameraStream, gate: ViewGate,
                scene: Scene) -> tuple[RecordedEpisode, dict[str, int]]:
    """
    Return the views that the node's view gate accepts, as one episode, and the node's counters.

    Raises DataError if no image becomes a view.
    """
    views = []
    counters: Counter[str] = Counter()
    refusal = early = ''
    for view in stream.views(wanted=lambda stamp: True):
        try:
            if isinstance(view, MessageError):
                raise view
            if not gate.wants(view.camera, view.stamp):
                counters['images'] += 1
                counters['images_unused'] += 1
                continue
            views.append(_view(view, None, stream, None, scene))
        except ViewError as error:
            if error.kind == NOT_BEGUN:  # no fault of the camera's
                early = early or str(error)
                counters['unjoined'] += 1
                continue
            refusal = refusal or str(error)
            counters[f'refused/{error.kind}'] += 1
            continue
        counters['images'] += 1
        gate.took(view.camera)
    refusal = refusal or early
    if not counters['images']:
        raise DataError(f'no image has a known camera: {refusal or "there is no image"}',
                        'no_views')
    if not views and refusal:
        raise DataError(f'no image became a view: {refusal}', 'no_views')
    if not views:
        raise DataError('no image became a view: expected a camera that stops, got '
                        f'{counters["images"]} images of a moving one', 'no_views')
    if unjoined := counters.pop('unjoined', 0):
        counters.update(images=unjoined, images_unused=unjoined)
    counters['views'] = len(views)
    return RecordedEpisode('', views[0].stamp, None, views, ''), dict(counters)


def _taken_views(stream: CameraStream, record: LoopRecord, stamps: Sequence[int]) -> list[View]:
    found: dict[int, View] = {}
    refusal = ''
    for view in stream.views(frozenset(stamps).__contains__, in_order=False):
        try:
            if isinstance(view, MessageError):
                raise view
            image = view.image  # decodes it: one that cannot be decoded is missing
        except MessageError as error:
            refusal = refusal or str(error)
            continue
        if view.stamp in found and not np.array_equal(found[view.stamp].image, image):
            raise _shared('images')
        found[view.stamp] = view
    if stream.went_back and not stream.assumed and not all(np.allclose(
            view.camera.pose, record.parts['view'][stamp], rtol=0, atol=_SAME_POSE)
            for stamp, view in found.items()):
        raise _shared('poses')
    for number, stamp in enumerate(stamps, 1):
        if stamp not in found and not (found and stream.begins_after(stamp)):
            raise DataError(f'the image or the camera of view {number} ({stamp / 1e9:.3f} s) is '
                            f'missing: {refusal or "the image was not recorded"}', 'no_image')
    return [found[stamp] for stamp in stamps if stamp in found]


def _shared(what: str) -> DataError:
    return DataError(f'the clock went back while it was recorded, and its {what} share their '
                     'stamps: expected later ones, or those of another time', 'clock')


def _episode(episode: Episode, views: Sequence[View], end: float, stream: CameraStream,
             record: LoopRecord, scene: Scene) -> RecordedEpisode:
    """Return an episode, with each goal after the view from which it was decided."""
    goals: dict[int, list[RecordedGoal]] = {}
    published = [record.published['view'][view.stamp] for view in views]
    if published != sorted(published):
        raise _shared('episodes')
    for goal in _goals(record, episode.begin, end):
        after = bisect_right(published, record.published['next_view'][goal.stamp])
        before = goals.setdefault(after, [])
        # The same place once more: `plan` asked for it again
        if not before or view_distance(before[-1].camera, goal.camera) > _ROUNDING:
            before.append(goal)
    decided = {after: replace(first, replacements=replacements)
               for after, (first, *replacements) in goals.items()}
    reasons = [(record.published['done'][stamp], reason)
               for stamp, (_, reason) in record.parts['done'].items()
               if episode.begin <= stamp < end]
    return RecordedEpisode(
        episode.id, episode.begin, decided.get(0),
        [_view(view, decided.get(number), stream, record, scene)
         for number, view in enumerate(views, 1)],
        max(reasons, default=(0, ''))[1])


def _goals(record: LoopRecord, begin: int, end: float) -> list[RecordedGoal]:
    goals = []
    for stamp, camera in sorted(record.parts['next_view'].items()):
        if begin <= stamp < end:
            candidates, scores = record.parts['azimuth_scores'].get(stamp, (None, None))
            azimuth = record.parts['next_azimuth'].get(stamp)
            goals.append(RecordedGoal(
                camera if azimuth is None else _with_azimuth(camera, azimuth), stamp, candidates,
                scores, record.received['next_view'][stamp],
                reason=record.parts['goal_reason'].get(stamp)))
    return goals


def _with_azimuth(camera: Camera, azimuth: float) -> Camera:
    """Return a goal's camera with the exact azimuth of the joint: its pose has a rounded one."""
    if abs(float(azimuth_difference(azimuth, camera.azimuth))) > _ROUNDING:
        return camera  # a joint with another zero or direction
    return OrbitCamera(camera.pose, camera.intrinsics, azimuth)


def _view(view: View, goal: RecordedGoal | None, stream: CameraStream,
          record: LoopRecord | None, scene: Scene) -> RecordedView:
    parts = record.parts if record else {}
    received = {role: times[view.stamp]
                for role, times in (stream.received | (record.received if record else {})).items()
                if view.stamp in times}

    def part(role: str) -> Any:
        return parts.get(role, {}).get(view.stamp)

    image = part('view_image')  # with the background removed, as the network saw it
    if image is None:
        image = scene.cleared(view.image, view.camera)
    whole = image is view.image
    return RecordedView(view.stamp, image, view.camera,
                        part('probabilities'), part('occupancy'), part('latent'), part('entropy'),
                        goal, received, (part('done') or (0, ''))[1], part('quality'),
                        reduced=view.reduced if whole else None)
