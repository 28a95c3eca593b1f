"""The numbers that a network computes with."""

from functools import cache
from pathlib import Path

from active_recon.errors import ConfigError

INT8 = 'int8'
PRECISIONS = ('auto', 'f32', 'bf16', INT8)
"""`auto` is bf16 where the processor has it, else f32; int8 are the convolutions of the decoder,
beside what `auto` is."""
_HALF = {'avx512_bf16', 'amx_bf16'}
_INTEGERS = {'avx512_vnni', 'avx_vnni', 'amx_int8'}


def chosen_precision(asked: str, device: str = 'cpu') -> str:
    """
    Return f32, bf16 or int8, by what is asked for and what the processor has.

    Raises ConfigError on another word, on a device that is not the CPU, and on bf16 or int8 where
    the processor would only imitate it, which takes longer than f32.
    """
    require_precision(asked)
    if device != 'cpu':
        raise ConfigError(f'device: not for exported graphs: expected cpu, got {device}; take the '
                          'runtime torch')
    if asked == 'bf16' and not has_bf16():
        raise ConfigError('precision: bf16 is not in this processor: expected avx512_bf16 or '
                          'amx_bf16, found neither; take f32')
    if asked == INT8 and not has_int8():
        raise ConfigError('precision: int8 is not in this processor: expected avx512_vnni, '
                          'avx_vnni or amx_int8, found none; take f32')
    if asked != 'auto':
        return asked
    return 'bf16' if has_bf16() else 'f32'


def require_precision(asked: str) -> None:
    """Raise ConfigError on a word that is no precision."""
    if asked not in PRECISIONS:
        raise ConfigError(f'precision: unknown value: expected one of {", ".join(PRECISIONS)}, '
                          f'got {asked!r}')


def require_f32(asked: str, runtime: str) -> None:
    """Raise ConfigError on a precision that a runtime, which computes in f32, has not."""
    require_precision(asked)
    if asked not in ('auto', 'f32'):
        raise ConfigError(f'precision: {asked} is not for the runtime {runtime}: expected '
                          'openvino, which takes weights that `active-recon export` exported, or '
                          'f32')


def has_bf16() -> bool:
    """Return whether the processor computes with bf16."""
    return bool(_HALF & _flags())


def has_int8() -> bool:
    """Return whether the processor sums products of 8-bit integers at once."""
    return bool(_INTEGERS & _flags())


@cache
def _flags() -> frozenset[str]:
    """Return what the processor says that it has; nothing where it does not say."""
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return frozenset()
    return frozenset(word for line in lines if line.startswith('flags') for word in line.split())
