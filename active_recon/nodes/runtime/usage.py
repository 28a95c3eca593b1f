"""What an executable says when it is asked for `--help`."""

from collections.abc import Iterator, Sequence
from importlib import import_module
import textwrap

from active_recon.parameters.declaration import Declared, declared

_WIDTH, _INDENT = 79, ' ' * 6


def is_help_wanted(arguments: Sequence[str]) -> bool:
    """Return whether `-h` or `--help` stands among what is not for ROS."""
    own = arguments[:arguments.index('--ros-args')] if '--ros-args' in arguments else arguments
    return bool({'-h', '--help'} & set(own))


def usage(node: str) -> str:
    """Return what a node does and its parameters, in lines of 79 characters at most."""
    # All nodes' parameters, and all policies with them: only who asks waits for them
    from active_recon.parameters.node_parameters import NODE_PARAMETERS

    about = (import_module(f'active_recon.nodes.{node}').__doc__ or '').strip().partition('\n')[0]
    lines = [
        f'usage: {node} [--ros-args [-p NAME:=VALUE] [-r OLD:=NEW] ...]',
        '', *textwrap.wrap(about, _WIDTH), '', 'parameters:']
    for each in declared(NODE_PARAMETERS[node]):
        lines += _parameter(each)
    return '\n'.join([*lines, '', 'A running node lists its topics: ros2 node info /' + node])


def _parameter(each: Declared) -> Iterator[str]:
    shown = ', '.join(each.default_words)
    yield '  ' + textwrap.shorten(f'{each.name} (default: {shown or "empty"})', _WIDTH - 2,
                                  placeholder=' ...)')
    yield from textwrap.wrap(f'{each.description}; {each.expected}', _WIDTH,
                             initial_indent=_INDENT, subsequent_indent=_INDENT)
