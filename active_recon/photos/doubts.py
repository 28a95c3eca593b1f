"""What is unusual about a reconstruction, and which convention of poses would fit instead."""

from collections.abc import Sequence
from dataclasses import replace

from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.photos.conventions import conventions
from active_recon.photos.cube import Cube
from active_recon.photos.hull import coverage, depth_in_masks, hull
from active_recon.photos.integrating import are_masked, COVERED, integrate
from active_recon.photos.shape import TakenView
from active_recon.photos.views import even_choice, PhotoView
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.better_cube import better_cube, box_text

_AGREE = 0.6  # silhouettes with a lower IoU contradict each other
_BETTER = 0.15  # by which another convention has to be above that, or above a coverage
_BETTER_COVERED = 0.03
_TRIED_VIEWS = 6
_CELLS = 64
_TOWARDS = 0.7  # cosine of the angle between the optical axis and the way to the object
_OUTSIDE = 3 ** 0.5 / 2  # of the cube, from its centre, in its sides


def unknown_front(reconstructor: Reconstructor) -> list[str]:
    """Return a warning of a network that sees no poses: its shape may be turned."""
    if not reconstructor.spec.needs_front:
        return []
    return ["the network needs the object's front, which photos do not tell: unless that is at +x "
            'of the object frame, the shape does not fit the photos; models such as '
            f'{DEFAULT_MODEL} need no front']


def doubts(taken: Sequence[TakenView], views: Sequence[PhotoView], cube: Cube,
           reconstructor: Reconstructor, background: str, covered: float,
           looks: str) -> list[str]:
    """
    Return the warnings of a reconstruction, one line each.

    `covered` is the masks' coverage. Where silhouettes contradict each other, other conventions
    of the poses are tried on a few views, and one that fits is named; `looks` are the camera axes
    that they were read with.
    """
    quality = taken[-1].known.quality
    if quality is None:
        found = [reconstructor.no_quality] if reconstructor.no_quality else []
    else:
        found = [quality.photo_warning] if quality.suspect else []
    enough = len(views) >= 3
    contradicted = enough and quality is not None and (
        quality.silhouette_iou < _AGREE or quality.suspect == 'pose')
    uncovered = covered < COVERED and len(views) > 1
    if contradicted or (enough and uncovered):
        advice = _fitting(even_choice(views, _TRIED_VIEWS), cube, reconstructor, background,
                          looks)
        if advice:
            return [*found, f'silhouettes contradict each other: {advice}']
    if uncovered:
        return [*found, f'masks contradict each other: their hull covers {covered:.0%} of one of '
                        'them; nothing is cut off by them: are masks and poses right?']
    if quality is not None and contradicted and not found:
        return ['silhouettes contradict each other (IoU with the reconstruction '
                f'{quality.silhouette_iou:.2f}): are poses and background right?']
    return found


def better_box(taken: Sequence[TakenView], cube: Cube, threshold: float) -> list[str]:
    """Return the warning of an object that does not fit its cube, with the box that does."""
    grid = taken[-1].known.grid
    found = better_cube(grid, threshold, len(taken))
    if found is None:
        return []
    placed = cube.world_from_object(grid.size)
    centre = (placed @ [*found.centre, 1.0])[:3]
    box = box_text(centre, found.side * cube.side / grid.size)
    return [f'{found.reason}: the box (--box) {box} fits it']


def _fitting(views: Sequence[PhotoView], cube: Cube, reconstructor: Reconstructor,
             background: str, looks: str) -> str:
    """Return the advice of the convention whose silhouettes agree best; '' for that in use."""
    masked = are_masked(views)
    best, advice = 0.0, ''
    for words, poses in conventions([view.camera.pose for view in views], looks).items():
        others = [replace(view, camera=Camera(pose, view.camera.intrinsics))
                  for view, pose in zip(views, poses, strict=True)]
        agreeing = (_covered(others, cube) if masked
                    else _agreement(others, cube, reconstructor, background))
        if agreeing > best:
            best, advice = agreeing, words
    own, needed = ((_covered(views, cube), _BETTER_COVERED) if masked else
                   (_agreement(views, cube, reconstructor, background), _BETTER))
    return advice if best >= own + needed else ''


def _covered(views: Sequence[PhotoView], cube: Cube) -> float:
    """Return the coverage of the masks; 0 where a camera does not look at the cube."""
    cameras = [cube.camera(view.camera, 1.0) for view in views]
    if any(camera.distance < _OUTSIDE or camera.pose[:3, 2] @ camera.direction > -_TOWARDS
           for camera in cameras):
        return 0.0
    return coverage(hull(depth_in_masks(views, cameras, _CELLS)), views, cameras)


def _agreement(views: Sequence[PhotoView], cube: Cube, reconstructor: Reconstructor,
               background: str) -> float:
    """Return the IoU of predicted and seen silhouettes; 0 where a view does not see the cube."""
    try:
        taken, left_out = integrate(views, cube, 1.0, reconstructor, background)
    except DataError:
        return 0.0
    quality = taken[-1].known.quality
    return 0.0 if quality is None or left_out else quality.silhouette_iou
