"""The numbers that a network computes with."""

from functools import cache
from pathlib import Path

from active_recon.errors import ConfigError

PRECISIONS = ('auto', 'f32', 'bf16')
"""`auto` is f32."""
_HALF = {'avx512_bf16', 'amx_bf16'}


def chosen_precision(asked: str, device: str = 'cpu') -> str:
    """
    Return f32 or bf16, by what is asked for and what the processor has.

    Raises ConfigError on another word, on a device that is not the CPU, and on bf16 where the
    processor would only imitate it, which takes longer than f32.
    """
    require_precision(asked)
    if device != 'cpu':
        raise ConfigError(f'device: not for exported graphs: expected cpu, got {device}; take the '
                          'runtime torch')
    if asked == 'bf16' and not has_bf16():
        raise ConfigError('precision: bf16 is not in this processor: expected avx512_bf16 or '
                          'amx_bf16, found neither; take f32')
    return 'f32' if asked == 'auto' else asked


def require_precision(asked: str) -> None:
    """Raise ConfigError on a word that is no precision."""
    if asked not in PRECISIONS:
        raise ConfigError(f'precision: unknown value: expected one of {", ".join(PRECISIONS)}, '
                          f'got {asked!r}')


def require_f32(asked: str, runtime: str) -> None:
    """Raise ConfigError on a precision that a runtime, which computes in f32, has not."""
    require_precision(asked)
    if asked == 'bf16':
        raise ConfigError(f'precision: bf16 is not for the runtime {runtime}: expected openvino, '
                          'which takes weights that `active-recon export` exported, or f32')


@cache
def has_bf16() -> bool:
    """Return whether the processor computes with bf16."""
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return False
    return any(_HALF & set(line.split()) for line in lines if line.startswith('flags'))
