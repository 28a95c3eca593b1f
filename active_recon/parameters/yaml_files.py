"""YAML files, read with an error in one line."""

from pathlib import Path

from active_recon.errors import ConfigError
import yaml


class _RosLoader(yaml.SafeLoader):
    """As ROS reads it, a date is text."""

    yaml_implicit_resolvers = {
        first: [(tag, rule) for tag, rule in rules if not tag.endswith(':timestamp')]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()}


def read_yaml(path: Path) -> object:
    """Return what a file holds; ConfigError, with line and reason, where it is no YAML."""
    try:
        return yaml.load(path.read_text(), _RosLoader)
    except FileNotFoundError as error:
        raise ConfigError(f'{path}: no such file: expected a ROS parameters file in YAML'
                          ) from error
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ConfigError(f'{path}: no ROS parameters file in YAML: '
                          f'{" ".join(str(error).split())}') from error
