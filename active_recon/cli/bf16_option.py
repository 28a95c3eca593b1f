"""The option for mixed precision in the commands that train and measure in torch."""

from typing import Annotated

from active_recon.runtimes.precision import has_bf16
import typer

Bf16 = Annotated[bool | None, typer.Option(
    '--bf16/--no-bf16', help='Mixed precision, bfloat16; default: where the processor, or in a '
                             'training the GPU, computes with it. Elsewhere it is imitated, and '
                             'takes many times as long.')]


def in_bf16(asked: bool | None) -> bool:
    """Return whether to measure in mixed precision: as asked for, else as the processor does."""
    return has_bf16() if asked is None else asked


def trained_in_bf16(asked: bool | None) -> bool:
    """Return the same of a training, which runs on a GPU where there is one."""
    from active_recon.training.loop import trains_in_bfloat16

    return trains_in_bfloat16() if asked is None else asked
