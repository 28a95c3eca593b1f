"""Options that mean something beside some others only."""

from collections.abc import Sequence

from active_recon.errors import ConfigError
import typer


def refuse_lone(context: typer.Context, needed: str, is_given: bool, *options: str) -> None:
    """Raise ConfigError where some of these options were given, and the one they need was not."""
    lone = _given(context, options)
    if lone and not is_given:
        raise ConfigError(f'{", ".join(lone)} without {needed}: they are for it alone')


def refuse_idle(context: typer.Context, beside: str, is_so: bool, *options: str) -> None:
    """Raise ConfigError where some of these options were given that have no effect, as it is."""
    idle = _given(context, options)
    if idle and is_so:
        raise ConfigError(f'{", ".join(idle)} {beside}: no effect there: expected none; leave '
                          f'{"them" if idle[1:] else "it"} out')


def _given(context: typer.Context, options: Sequence[str]) -> list[str]:
    return [f'--{name.replace("_", "-")}' for name in options
            if (source := context.get_parameter_source(name)) and source.name == 'COMMANDLINE']
