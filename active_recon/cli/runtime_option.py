"""The option for what runs networks in the commands that measure them."""

from typing import Annotated

from active_recon.runtimes import RUNTIME_CHOICES
import typer

MeasuredIn = Annotated[str, typer.Option(
    '--runtime', help=f'What runs the networks, one of {", ".join(RUNTIME_CHOICES)}. Outside '
                      'torch, exported networks measure 1.5 to 2 times as many '
                      'objects a second, and IoU agrees within .0005 with --no-bf16; auto runs in '
                      'torch what is not exported.')]
