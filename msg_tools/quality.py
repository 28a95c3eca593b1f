"""The quality of a reconstruction to and from a DiagnosticArray with the stamp of its view."""

from dataclasses import asdict, fields
import math

from active_recon.errors import MessageError
from active_recon.quality.quality import Quality, SUSPECTS
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

NAME = 'quality'
_SUSPECT = 'suspect'
_LATER = 'promise_learned'  # messages of earlier versions lack it
_SIZE = 'object_size'  # likewise
_NUMBERS = tuple(field.name for field in fields(Quality) if field.name not in (_SUSPECT, _LATER))


def quality_to_msg(quality: Quality, header: Header, weights_sha256: str = '',
                   object_size: float | None = None) -> DiagnosticArray:
    """
    Return one status: the numbers as values; WARN, with the question to ask, if flagged.

    `hardware_id` is the SHA-256 of the network's weights, which are what judges; `object_size` the
    side in metres of the cube that is judged.
    """
    values = {**asdict(quality), _SIZE: object_size}
    return DiagnosticArray(header=header, status=[DiagnosticStatus(
        level=DiagnosticStatus.WARN if quality.suspect else DiagnosticStatus.OK, name=NAME,
        message=quality.warning or 'ok', hardware_id=weights_sha256,
        values=[KeyValue(key=name, value=str(value)) for name, value in values.items()
                if value is not None])])


def quality_from_msg(msg: DiagnosticArray) -> Quality:
    """
    Return the quality, bit by bit as it was sent.

    Raises MessageError where a value is missing or no number in [0, 1], or the suspect unknown.
    """
    values = {pair.key: pair.value for status in msg.status if status.name == NAME
              for pair in status.values}
    missing = [name for name in (*_NUMBERS, _SUSPECT) if name not in values]
    if missing:
        raise MessageError(f'incomplete quality: expected {", ".join(missing)} too, got '
                           f'{", ".join(values) or "nothing"}', NAME)
    suspect = values[_SUSPECT]
    if suspect and suspect not in SUSPECTS:
        raise MessageError('unknown suspect: expected one of '
                           f'{", ".join(SUSPECTS)}, got {suspect!r}', NAME)
    return Quality(**{name: _share(name, values[name]) for name in _NUMBERS}, suspect=suspect,
                   promise_learned=_share(_LATER, values[_LATER]) if _LATER in values else None)


def judging_weights(msg: DiagnosticArray) -> str:
    """Return the SHA-256 of the weights that judged; '' where the message does not tell."""
    return next((status.hardware_id for status in msg.status if status.name == NAME), '')


def judged_size(msg: DiagnosticArray) -> float | None:
    """Return the side of the cube that was judged, metres; None where the message tells none."""
    told = (pair.value for status in msg.status if status.name == NAME
            for pair in status.values if pair.key == _SIZE)
    try:
        return next(map(float, told), None)
    except ValueError:
        return None


def _share(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 1:
        raise MessageError(f'invalid quality: expected {name} in [0, 1], got {text!r}', NAME)
    return value
