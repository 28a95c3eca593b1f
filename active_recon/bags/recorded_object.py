"""A recorded object as an environment: its images and cameras, looked at again view by view."""

from collections.abc import Iterator, Sequence

from active_recon.bags.run import RecordedView
from active_recon.environment import run_episode, TimeStep
from active_recon.reconstructor import Reconstruction, Reconstructor


class RecordedObject:
    """An environment of recorded views; what is known after each is what a reconstructor says."""

    def __init__(self, reconstructor: Reconstructor) -> None:
        self._reconstructor = reconstructor

    def reset(self) -> None:
        """Begin an episode: nothing was seen yet."""
        self._reconstructor.reset()

    def step(self, view: RecordedView) -> Reconstruction:
        """Fold a view in; raises ViewError on one that is none."""
        return self._reconstructor.add_view(view.image, view.camera)


def seen_again(views: Sequence[RecordedView], reconstructor: Reconstructor
               ) -> Iterator[TimeStep[RecordedView, Reconstruction]]:
    """Run an episode of the views as they were taken, in the order of their stamps."""
    ordered = sorted(views, key=lambda view: view.stamp)
    if ordered:
        yield from run_episode(RecordedObject(reconstructor), ordered[0],
                               lambda step: ordered[step.number], len(ordered))
