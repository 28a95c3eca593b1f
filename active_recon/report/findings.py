"""Warnings and notes on a run, each in one sentence."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

from active_recon.acquisition.view_gate import GOAL_TOLERANCE
from active_recon.bags.runs.missing import describe_lost
from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import PHOTOS
from active_recon.geometry.cameras import CANONICAL_ELEVATION, ELEVATION_TOLERANCE, whole_degrees
from active_recon.geometry.view_distance import view_distance
from active_recon.report.stages import two_clocks
from active_recon.report.subject import shown_grid, Subject
from active_recon.report.words import counted, refusals, times, view_numbers, warned
from active_recon.volumes.better_cube import better_cube

_STOPPED = {
    'max_views': ('view limit', 'It stopped because it had taken as many views as '
                                'allowed.'),
    'entropy_settled': ('settled', 'It stopped by itself: the last two views hardly changed '
                                   'the entropy.'),
    'target_reached': ('target reached', 'It stopped because the IoU that was asked for is '
                                         'promised.'),
    'target_out_of_reach': ('target out of reach', 'It stopped because the IoU that was asked for '
                                                   'is out of reach for this object.'),
    'gain_too_small': ('gain too small', 'It stopped because no further view was worth taking.'),
    'no_reachable_azimuth': ('no reachable goal', 'It stopped because no view was left that the '
                                                  'camera can reach.'),
    'stopped': ('stopped', 'It was stopped by a service call.'),
    'no_planner': ('no planner', 'No planner was recorded: the views are those that the camera '
                                 'passed.'),
    PHOTOS: ('last photo', 'It ended with the last photo.'),
    '': ('no end recorded', 'The episode is incomplete: the recording ends, or a new episode '
                            'begins, before it was done.'),
}
_TOLD_OTHERWISE = ('warned/elevation', 'warned/cube')


@dataclass(frozen=True)
class Finding:
    """A sentence and its level: 'warning' or 'note'."""

    level: str
    text: str


def findings(subject: Subject) -> list[Finding]:
    """Return the findings on an episode, warnings first."""
    found = [Finding(level, text) for level, text in (
        *_beginning(subject), *_stop(subject), *_counted(subject), *_missing(subject),
        *_lost(subject), *_off_goal(subject), *_unusual(subject), *_cube(subject),
        *_off_elevation(subject), *_estimate(subject))]
    return sorted(found, key=lambda finding: finding.level != 'warning')


def stopped(reason: str) -> str:
    """Return a short text for the planner's reason to stop."""
    word, _ = _STOPPED.get(reason, (reason, ''))
    return word


def _beginning(subject: Subject) -> Iterator[tuple[str, str]]:
    if subject.episode.begun_before:
        yield 'warning', ('Earlier views are missing: the bag has no image of them, from before '
                          'the camera or the episode was recorded.')


def _stop(subject: Subject) -> Iterator[tuple[str, str]]:
    _, sentence = _STOPPED.get(subject.end, ('', f'It stopped for the reason “{subject.end}”.'))
    yield 'note' if subject.end else 'warning', sentence


def _counted(subject: Subject) -> Iterator[tuple[str, str]]:
    """Yield the findings from the nodes' counters, which count the whole run."""
    for node, counts in sorted(subject.run.counters.items()):
        name = node.strip('/')
        for refusal in refusals(counts):
            yield 'warning', f'{refusal} (counted by the {name}).'
        for key, count in sorted(counts.items()):
            if count > 0 and key.startswith('warned/') and key not in _TOLD_OTHERWISE:
                yield 'warning', (f'The {name} warned {times(count)} of '
                                  f'{warned(key.removeprefix("warned/"))}.')
        if {'images', 'views', 'images_unused'} <= counts.keys():
            yield 'note', (f'The {name} received {counted(counts["images"], "image")}: '
                           f'{counted(counts["views"], "view")} and '
                           f'{counted(counts["images_unused"], "unused image")}, taken while the '
                           'camera moved or waited, as intended.')


def _missing(subject: Subject) -> Iterator[tuple[str, str]]:
    """Yield the findings on images that never arrived."""
    gaps = subject.run.gaps
    if gaps.missing and gaps.period_s:
        are = 'is' if gaps.missing == 1 else 'are'
        yield 'warning', (f'About {counted(gaps.missing, "image")} {are} missing: the camera '
                          f'usually sends one every {1e3 * gaps.period_s:.0f} ms; the longest '
                          f'gap is {gaps.longest_s:.1f} s.')
    if gaps.uncounted:
        were = 'was' if gaps.uncounted == 1 else 'were'
        yield 'warning', (f'{counted(gaps.uncounted, "image")} that {were} recorded never reached '
                          'the reconstructor.')


def _lost(subject: Subject) -> Iterator[tuple[str, str]]:
    if lost := describe_lost(subject.episode):
        yield 'warning', (f'The recording lacks {", ".join(lost)}: published, but not received '
                          'by the recorder.')


def _off_goal(subject: Subject) -> Iterator[tuple[str, str]]:
    parameters = node_parameters(subject.run, 'reconstructor')
    tolerance = parameters.get('goal_tolerance', GOAL_TOLERANCE)
    for number, (view, goal) in enumerate(zip(subject.views, subject.goals, strict=False), 1):
        away = 0.0 if goal is None else view_distance(view.camera, goal.camera)
        if away > tolerance:
            yield 'warning', (f'View {number} was taken {math.degrees(away):.0f}° away from its '
                              'goal.')


def _unusual(subject: Subject) -> Iterator[tuple[str, str]]:
    told: dict[str, list[int]] = {}
    for number, view in enumerate(subject.views, 1):
        if view.quality is not None and view.quality.suspect:
            warning = (view.quality.photo_warning if subject.of_photos else view.quality.warning)
            told.setdefault(warning, []).append(number)
    for warning, numbers in told.items():
        yield 'warning', f'After {view_numbers(numbers)}: {warning}'


def _cube(subject: Subject) -> Iterator[tuple[str, str]]:
    """Yield that the cube does not fit the object, as the last view shows it."""
    grid = shown_grid(subject.views[-1]) if subject.views else None
    better = None if grid is None else better_cube(grid, subject.threshold, len(subject.views))
    if better is not None:
        words = better.reason if subject.of_photos else better.warning_of_bag
        yield 'warning', f'{words[0].upper()}{words[1:]}.'


def _off_elevation(subject: Subject) -> Iterator[tuple[str, str]]:
    if subject.run.provenance.get('needs_front') == 'false':
        return  # such a network accepts any camera
    off = [(number, view.camera.elevation) for number, view in enumerate(subject.views, 1)
           if abs(view.camera.elevation - CANONICAL_ELEVATION) > ELEVATION_TOLERANCE]
    if off:
        listed = ', '.join(f'{number} ({math.degrees(elevation):.0f}°)'
                           for number, elevation in off)
        views = 'view' if len(off) == 1 else 'views'
        yield 'warning', (
            f'The camera was not at the elevation of {whole_degrees(CANONICAL_ELEVATION)}° that '
            f'the network was trained with, in {views} {listed}: the shape will be worse.')


def _estimate(subject: Subject) -> Iterator[tuple[str, str]]:
    if subject.computed:
        yield 'note', ('The bag has no reconstruction. The shapes shown here were computed from '
                       f'its images for this page, with {subject.computed}.')
    for assumption in subject.run.assumed if subject.computed else ():
        yield 'note', f'Assumed, since the bag does not say: {assumption}.'
    if subject.placed:
        yield 'note', subject.placed
    known = [entropy for entropy in subject.entropies if entropy is not None]
    if len(known) > 1 and known[-1] > known[0]:
        yield 'note', 'After the last view the estimate was less certain than after the first.'
    if any(map(two_clocks, subject.views)):
        yield 'warning', ('The stamps of the images and the recorder’s times are from different '
                          'clocks, so the latency of the images is unknown.')
