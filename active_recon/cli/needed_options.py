"""Options that mean something beside another one only."""

from active_recon.errors import ConfigError
import typer


def refuse_lone(context: typer.Context, needed: str, is_given: bool, *options: str) -> None:
    """Raise ConfigError where some of these options were given, and the one they need was not."""
    lone = [f'--{name.replace("_", "-")}' for name in options
            if (source := context.get_parameter_source(name)) and source.name == 'COMMANDLINE']
    if lone and not is_given:
        raise ConfigError(f'{", ".join(lone)} without {needed}: they are for it alone')
