"""YAML files, read with an error in one line."""

from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.yaml_text import yaml_value


def read_yaml(path: Path) -> object:
    """Return what a file holds; ConfigError, with line and reason, where it is no YAML."""
    try:
        return yaml_value(path.read_text())
    except FileNotFoundError as error:
        raise ConfigError(f'{path}: no such file: expected a ROS parameters file in YAML'
                          ) from error
    except (OSError, ValueError) as error:
        raise ConfigError(f'{path}: no ROS parameters file in YAML: {error}') from error
