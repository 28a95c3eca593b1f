"""The page's address, on this machine only."""

import socket

from active_recon.errors import ConfigError
from active_recon.parameters.viewer import DEFAULT_PORT, HIGHEST_PORT

HOST = '127.0.0.1'


def is_served(port: int) -> bool:
    """Return whether a server answers on a port of this machine."""
    with socket.socket() as probe:
        return probe.connect_ex((HOST, port)) == 0


def free_port(first: int = DEFAULT_PORT) -> int:
    """Return the first free port from `first` on; raises ConfigError if there is none."""
    for port in range(first, HIGHEST_PORT + 1):
        with socket.socket() as probe:
            try:
                probe.bind((HOST, port))
            except OSError:
                continue
            return port
    raise ConfigError(f'no port is free from {first} to {HIGHEST_PORT}')
