"""What a training says as it goes: a progress bar, and TensorBoard's curves and pictures."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from torch.utils.tensorboard import SummaryWriter

if TYPE_CHECKING:
    from active_recon.datasets.views import ViewSet
    from active_recon.models.network import ReconstructionNetwork


class SummaryLog:
    """
    A log in a folder; where a training is resumed, it takes the place of what was cut off.

    Whenever a network was validated, its picture of some of the `shown` objects is logged.
    """

    def __init__(self, folder: Path, shown: 'ViewSet') -> None:
        self._folder, self._shown = folder, shown
        self._writers: dict[str, SummaryWriter] = {}

    def show(self, stage: str, step: int, network: 'ReconstructionNetwork') -> None:
        """Log what the network makes of the objects after so many steps."""
        from active_recon.training.pictures import progress_picture

        self._writer(stage, step).add_image(
            f'{stage}/validation', progress_picture(network, self._shown), step,
            dataformats='HWC')

    @contextmanager
    def reporting(self, stage: str, steps: int) -> Iterator[
            Callable[[int, dict[str, float]], None]]:
        """Yield what is told the steps of a stage and what each measured."""
        done = 0
        shown: dict[str, float] = {}
        with progress_bar(stage, steps) as advance:
            def report(step: int, measured: dict[str, float]) -> None:
                nonlocal done
                for name, value in measured.items():
                    self._writer(stage, step).add_scalar(f'{stage}/{name}', value, step)
                    # Single batches are noisy: the bar shows a running mean
                    smooth = name in shown and not name.startswith('validation')
                    shown[name] = 0.98 * shown[name] + 0.02 * value if smooth else value
                told = '  '.join(f'{name} {value:.4f}' for name, value in shown.items())
                advance(step - done, told)
                done = step

            yield report

    def _writer(self, stage: str, step: int) -> SummaryWriter:
        """Return the stage's writer; what the log has from its first step on is passed by."""
        if stage not in self._writers:
            # Of its own folder: there alone what is passed by is passed by
            self._writers[stage] = SummaryWriter(self._folder / stage, purge_step=step)
        return self._writers[stage]

    def __enter__(self) -> 'SummaryLog':
        """Log until the block ends."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the log."""
        for writer in self._writers.values():
            writer.close()
