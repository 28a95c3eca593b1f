"""The option for mixed precision in the commands that train and measure in torch."""

from typing import Annotated

from active_recon.runtimes.precision import has_bf16
import typer

Bf16 = Annotated[bool | None, typer.Option(
    '--bf16/--no-bf16', help='Mixed precision, bfloat16; default: where the processor, or in a '
                             'training the GPU, computes with it. Elsewhere it is imitated, and '
                             'takes many times as long.')]


def in_bf16(asked: bool | None, device: str = 'cpu') -> bool:
    """Return whether to compute in mixed precision, as asked for or as suits the device."""
    return (device != 'cpu' or has_bf16()) if asked is None else asked


def training_device() -> str:
    """Return what a training runs on: the GPU where there is one."""
    import torch

    return 'cuda' if torch.cuda.is_available() else 'cpu'
