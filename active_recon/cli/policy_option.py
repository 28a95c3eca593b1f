"""The option for a policy, with the names in the registry as allowed values."""

from collections.abc import Sequence
from typing import Any

from active_recon.policies import POLICIES
import typer


def policy_option(meaning: str, also: Sequence[str] = ()) -> Any:
    """
    Return the option for a policy; its help is `meaning` and the list of allowed names.

    `also` are names that are allowed beside those in the registry.
    """
    names = (*also, *POLICIES)

    def one_of_them(name: str | None) -> str | None:
        if name is not None and name not in names:
            raise typer.BadParameter(f'{name!r} is not one of {", ".join(map(repr, names))}.')
        return name

    return typer.Option(callback=one_of_them, metavar=f'[{"|".join(names)}]', help=meaning)
