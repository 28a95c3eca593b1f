"""What the runs on a page are, in a few sentences at its top."""

from collections.abc import Sequence

from active_recon.report.subject import Subject
from active_recon.report.words import counted

_OF_PHOTOS = 'After every photo a neural network updated its estimate of the object’s shape.'
_TAKEN = ('A camera took views of an object. After every view a neural network updated its '
          'estimate of the object’s shape')


def introduction(subjects: Sequence[Subject]) -> str:
    """Return how the runs were made: by a camera with a planner, or of photos."""
    several = len(subjects) > 1
    letters = [subject.letter for subject in subjects if subject.of_photos]
    if len(letters) < len(subjects):
        chosen = (', and a planner chose the next view.'
                  if any(subject.planned for subject in subjects) else '.')
        if not several:
            return f'{_TAKEN}{chosen} This page shows that run.'
        apart = (f', but {", ".join(letters)} {"was" if len(letters) == 1 else "were"} made of '
                 'photos with known cameras, which no planner chose' if letters else '')
        return f'{_TAKEN}{chosen} Each letter below is one such run{apart}.'
    if several:
        return f'Each letter below is a run made of photos with known cameras. {_OF_PHOTOS}'
    count = len(subjects[0].views)
    cameras = 'a known camera' if count == 1 else 'known cameras'
    return f'This run was made of {counted(count, "photo")} with {cameras}. {_OF_PHOTOS}'
