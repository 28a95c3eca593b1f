"""A recorded object as an environment: its images and cameras, looked at again view by view."""

from collections.abc import Iterator, Sequence

from active_recon.bags.runs.run import RecordedView
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import ViewError
from active_recon.reconstructor import Reconstruction, Reconstructor


class RecordedObject:
    """An environment of recorded views; what is known after each is what a reconstructor says."""

    def __init__(self, reconstructor: Reconstructor) -> None:
        self._reconstructor = reconstructor

    def reset(self) -> None:
        """Begin an episode: nothing was seen yet."""
        self._reconstructor.reset()

    def step(self, view: RecordedView) -> Reconstruction:
        """Fold a view in; raises ViewError that says what may be told where it is none."""
        try:
            return self._reconstructor.add_view(view.image, view.camera)
        except ViewError as error:
            raise told_option(error) from error


def told_option(error: ViewError) -> ViewError:
    """Return the error with the option that a command has for it."""
    hint = '; --object-size tells its side' if error.kind == 'out_of_image' else ''
    return ViewError(f'{error}{hint}', error.kind)


def seen_again(views: Sequence[RecordedView], reconstructor: Reconstructor
               ) -> Iterator[TimeStep[RecordedView, Reconstruction]]:
    """Run an episode of the views as they were taken, in the order of their stamps."""
    ordered = sorted(views, key=lambda view: view.stamp)
    if ordered:
        yield from run_episode(RecordedObject(reconstructor), ordered[0],
                               lambda step: ordered[step.number], len(ordered))
