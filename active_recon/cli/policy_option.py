"""The option for a policy, with the names in the registry as allowed values."""

from typing import Any

from active_recon.policies import POLICIES
import typer


def _one_of_them(name: str | None) -> str | None:
    if name is not None and name not in POLICIES:
        raise typer.BadParameter(f'{name!r} is not one of {", ".join(map(repr, POLICIES))}.')
    return name


def policy_option(meaning: str) -> Any:
    """Return the option for a policy; its help is `meaning` and the list of allowed names."""
    return typer.Option(callback=_one_of_them, metavar=f'[{"|".join(POLICIES)}]', help=meaning)
