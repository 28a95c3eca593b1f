"""The definitions of message types as a bag stores them, read from the installed packages."""

from functools import cache
from importlib import import_module
import os
from pathlib import Path
import re
import sys

from active_recon.errors import RecordingError

_SEPARATOR = '=' * 80
_PRIMITIVES = {'bool', 'byte', 'char', 'float32', 'float64', 'int8', 'uint8', 'int16', 'uint16',
               'int32', 'uint32', 'int64', 'uint64', 'string', 'wstring'}
# A field is a type, its array or string bound if any, and a name; a constant has '=' next.
_FIELD = re.compile(r'^(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+\s*(?!.*=)')


@cache
def message_definition(type_name: str) -> str:
    """
    Return a type's definition in the ros2msg form, for example of 'std_msgs/msg/Header'.

    That is the text of the message file, followed by that of every type it contains, each after
    a line of 80 '=' and 'MSG: pkg/Name'. Raises RecordingError where one is not installed.
    """
    package, _, name = type_name.split('/')
    texts = {f'{package}/{name}': _message_file(package, name)}
    waiting = _named_types(package, texts[f'{package}/{name}'])
    while waiting:
        part = waiting.pop(0)
        if part not in texts:
            package, name = part.split('/')
            texts[part] = _message_file(package, name)
            waiting += _named_types(package, texts[part])
    first, *parts = texts
    return texts[first] + ''.join(
        f'\n{_SEPARATOR}\nMSG: {part}\n{texts[part]}' for part in parts)


def message_class(type_name: str) -> type:
    """Return the Python class of a type, for example of 'std_msgs/msg/Header'."""
    package, kind, name = type_name.split('/')
    message: type = getattr(import_module(f'{package}.{kind}'), name)
    return message


def _message_file(package: str, name: str) -> str:
    # ROS from wheels is in the Python environment, which needs no sourcing.
    prefixes = [*filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(':')), sys.prefix]
    for prefix in prefixes:
        path = Path(prefix, 'share', package, 'msg', f'{name}.msg')
        if path.is_file():
            return path.read_text()
    raise RecordingError(f'no definition of {package}/msg/{name}: expected its message file under '
                         f'share/ in one of {", ".join(prefixes)}, but it is in '
                         'none', 'message_definition')


def _named_types(package: str, text: str) -> list[str]:
    """Return the message types of a message file's fields, as 'pkg/Name', in their order."""
    fields = (_FIELD.match(line.split('#')[0].strip()) for line in text.splitlines())
    named = [field['type'] for field in fields if field and field['type'] not in _PRIMITIVES]
    return [name if '/' in name else f'{package}/{name}' for name in named]
