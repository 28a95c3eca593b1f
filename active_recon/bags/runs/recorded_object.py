"""A recorded object as an environment, whose actions are its recorded views."""

from collections.abc import Iterator, Sequence

from active_recon.bags.runs.run import RecordedView
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import ViewError
from active_recon.reconstructor import Reconstruction, Reconstructor


class RecordedObject:
    """An environment of recorded views, whose observations are reconstructions."""

    def __init__(self, reconstructor: Reconstructor) -> None:
        self._reconstructor = reconstructor

    def reset(self) -> None:
        """Begin an episode without views."""
        self._reconstructor.reset()

    def step(self, view: RecordedView) -> Reconstruction:
        """Reconstruct with one more view; raises ViewError with a hint on the options."""
        try:
            return self._reconstructor.add_view(
                *view.for_network(self._reconstructor.reduction(view.camera)), view.depth)
        except ViewError as error:
            raise with_option_hint(error) from error


def with_option_hint(error: ViewError) -> ViewError:
    """Return the error with the command line option that may help."""
    hint = '; --object-size sets its side' if error.kind == 'out_of_image' else ''
    return ViewError(f'{error}{hint}', error.kind)


def replay_views(views: Sequence[RecordedView], reconstructor: Reconstructor
               ) -> Iterator[TimeStep[RecordedView, Reconstruction]]:
    """Yield the steps of an episode with the recorded views, in the order of their stamps."""
    ordered = sorted(views, key=lambda view: view.stamp)
    if ordered:
        yield from run_episode(RecordedObject(reconstructor), ordered[0],
                               lambda step: ordered[step.number], len(ordered))
