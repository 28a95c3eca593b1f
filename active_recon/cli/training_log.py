"""The log of a training: a progress bar, and TensorBoard's curves and images."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
import threading
from types import TracebackType
from typing import TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from active_recon.errors import DataError
from active_recon.reporting import by_step
from torch.utils.tensorboard import SummaryWriter

if TYPE_CHECKING:
    from active_recon.datasets.views import ViewSet
    from active_recon.models.network import ReconstructionNetwork


class SummaryLog:
    """
    A log in a folder; a resumed training overwrites the steps after its checkpoint.

    After every validation the network's prediction of some of the `shown` objects is logged.
    Raises DataError where the log cannot be written.
    """

    def __init__(self, folder: Path, shown: 'ViewSet') -> None:
        self._folder, self._shown = folder, shown
        self._writers: dict[str, SummaryWriter] = {}
        self._hook = threading.excepthook

    def show(self, stage: str, step: int, network: 'ReconstructionNetwork') -> None:
        """Log an image of the network's predictions after a number of steps."""
        from active_recon.training.pictures import progress_picture

        with self._writing():
            self._writer(stage, step).add_image(
                f'{stage}/validation', progress_picture(network, self._shown), step,
                dataformats='HWC')

    @contextmanager
    def reporting(self, stage: str, steps: int) -> Iterator[
            Callable[[int, dict[str, float]], None]]:
        """Yield the report of a stage: it takes each step and what was measured."""
        shown: dict[str, float] = {}
        with progress_bar(stage, steps) as advance:
            reached = by_step(advance)

            def report(step: int, measured: dict[str, float]) -> None:
                for name, value in measured.items():
                    with self._writing():
                        self._writer(stage, step).add_scalar(f'{stage}/{name}', value, step)
                    # Single batches are noisy: the bar shows a running mean
                    smooth = name in shown and not name.startswith('validation')
                    shown[name] = 0.98 * shown[name] + 0.02 * value if smooth else value
                reached(step, '  '.join(f'{name} {value:.4f}' for name, value in shown.items()))

            yield report

    def _writer(self, stage: str, step: int) -> SummaryWriter:
        """Return the stage's writer; logged steps from its first step on are purged."""
        if stage not in self._writers:
            # A folder for each stage: a purge affects the whole folder
            self._writers[stage] = SummaryWriter(self._folder / stage, purge_step=step)
        return self._writers[stage]

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise DataError(f'{self._folder}: not written: expected a folder with room, got: '
                            f'{error.strerror}; make room, and continue with --resume') from error

    def __enter__(self) -> 'SummaryLog':
        """Log until the block ends."""
        threading.excepthook = self._thread_failed
        return self

    def _thread_failed(self, failed: threading.ExceptHookArgs) -> None:
        """Leave to `_writing` what a writer's thread fails of: the writer raises it here, too."""
        if not issubclass(failed.exc_type, OSError):
            self._hook(failed)

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the log."""
        try:
            with self._writing() if value is None else suppress(OSError):
                for writer in self._writers.values():
                    writer.close()
        finally:
            threading.excepthook = self._hook
