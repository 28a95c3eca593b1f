"""The rows of the table: one for each episode of a bag, or one for a bag that was refused."""

from collections.abc import Mapping
import hashlib
import math
from typing import Any

from active_recon.errors import ActiveReconError
from active_recon.report.findings import findings
from active_recon.report.stages import median, timings
from active_recon.report.subject import object_of, shown_grid, Subject

COLUMNS: Mapping[str, tuple[str, str]] = {
    'bag': ('string', 'path of the bag'),
    'refused': ('string', 'why the bag has no result; empty where it has one'),
    'refused_kind': ('string', 'the same in a word'),
    'episode': ('int32', 'number of the episode in the bag, from 1; none if refused'),
    'episode_id': ('string', 'its id, as recorded'),
    'object': ('string', 'name of the object, if the bag has it'),
    'policy': ('string', 'policy that chose the views, if known'),
    'views': ('int32', 'number of views'),
    'expected_iou': ('double', 'expected IoU after the last view, without the truth'),
    'iou_lower_bound': ('double', 'IoU that nine of ten objects exceed'),
    'iou': ('double', 'IoU with the truth after the last view, if the truth is known'),
    'entropy': ('double', 'nats after the last view'),
    'stopped': ('string', 'reason of the planner for the end; empty if there is none, no_planner '
                          'without a planner'),
    'verdict': ('string', 'of a replay: same bits, within tolerance, different, nothing recorded'),
    'recorded': ('timestamp', 'first message of the bag, UTC'),
    'duration_s': ('double', 'from the first message of the bag to the last'),
    'image_to_goal_ms': ('double', 'median time from an image to the goal that follows'),
    'travel_deg': ('double', 'azimuth travelled between the views'),
    'warnings': ('strings', 'what the report warns of'),
    'weights_sha256': ('string', 'hash of the weights of the reconstruction, if known'),
    'shapes_sha256': ('string', 'hash of the probabilities after each view'),
    'report': ('string', "path of the bag's report, relative to the table's folder"),
}
"""Type and meaning of each column."""
Row = dict[str, Any]


def refused_row(bag: str, error: ActiveReconError) -> Row:
    """Return the row of a bag that was refused."""
    return refusal_row(bag, str(error), error.kind)


def refusal_row(bag: str, refusal: str, kind: str) -> Row:
    """Return the row of a bag that was refused for a reason, with its kind."""
    return {**dict.fromkeys(COLUMNS), 'bag': _text(bag), 'refused': _text(refusal),
            'refused_kind': kind}


def episode_row(bag: str, number: int, subject: Subject, verdict: str, report: str) -> Row:
    """Return the row of one episode; `report` is the path of its page, '' for none."""
    run, episode, views = subject.run, subject.episode, subject.views
    last = views[-1] if views else None
    quality = None if last is None else last.quality
    return {
        'bag': _text(bag), 'refused': '', 'refused_kind': '', 'episode': number,
        'episode_id': episode.id, 'object': object_of(run, episode),
        'policy': run.provenance.get('policy', ''), 'views': len(views),
        'expected_iou': None if quality is None else _finite(quality.expected_iou),
        'iou_lower_bound': None if quality is None else _finite(quality.lower_bound),
        'iou': subject.ious[-1] if views else None,
        'entropy': subject.entropies[-1] if views else None,
        'stopped': subject.end, 'verdict': verdict,
        'recorded': run.begin // 1000 if run.begin > 0 else None,
        'duration_s': (run.end - run.begin) / 1e9,
        'image_to_goal_ms': median([each.total for each in timings(episode, subject.timed)]),
        'travel_deg': math.degrees(subject.travel),
        'warnings': [each.text for each in findings(subject) if each.level == 'warning'],
        'weights_sha256': run.provenance.get('weights_sha256', ''),
        'shapes_sha256': _shapes_hash(subject) if views else '', 'report': report}


def _text(text: str) -> str:
    """Return a text that every reader takes, whatever bytes the name of a file has."""
    return text.encode('utf-8', 'surrogateescape').decode('utf-8', 'replace')


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _shapes_hash(subject: Subject) -> str:
    digest = hashlib.sha256()
    for view in subject.views:
        grid = shown_grid(view)
        if grid is not None:
            digest.update(grid.occupancy.tobytes())
    return digest.hexdigest()
