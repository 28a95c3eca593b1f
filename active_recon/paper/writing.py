"""A part's result on disk: Markdown, JSON and PNG, with their provenance."""

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from active_recon.errors import DataError
from active_recon.json_text import json_value
from active_recon.models.weights_files import FOLDER, read_card, weights_hash
from active_recon.paper.claims import sentences
from active_recon.paper.results import Claim, Result
from active_recon.paper.study import Objects, Study
from active_recon.paper.trainings import views_seen
from active_recon.whole_files import whole_file
from PIL import Image

Inputs = Mapping[str, Any]
_MADE_BY = 'Made by'
_SUFFIXES = ('.json', '.md', '.png')


def provenance(study: Study, sets: Mapping[str, Objects], weights: Mapping[str, Path],
               **more: Any) -> dict[str, Any]:
    """
    Return the inputs of a result: hashes of data and weights, and settings.

    A part is made again when they change.
    """
    return {
        'data': {name: objects.identity() for name, objects in sets.items()},
        'generators': study.generators(), 'seed': study.seed, 'starts': study.starts,
        'weights': {name: _origin(path) for name, path in weights.items()}, **more}


def _origin(weights: Path) -> dict[str, Any]:
    card = read_card(weights)
    file = f'{weights.name}, which ships' if weights.parent == FOLDER else str(weights)
    return {'file': file, 'sha256': weights_hash(weights),
            'threshold': card.get('threshold'), 'views seen in training': views_seen(card)}


def read_result(study: Study, name: str) -> dict[str, Any]:
    """Return a part's JSON; raises DataError where it cannot be read."""
    path = study.out / f'{name}.json'
    try:
        found: dict[str, Any] = json_value(path.read_bytes())
    except (OSError, ValueError) as error:
        raise DataError(f'{path}: no readable result: expected that of `active-recon paper '
                        f'{name}`, got: {error}') from error
    return found


def is_current(study: Study, name: str, inputs: Inputs) -> bool:
    """Return whether a part's three files exist and were made from the same inputs."""
    if not all((study.out / f'{name}{suffix}').is_file() for suffix in _SUFFIXES):
        return False
    try:
        return bool(read_result(study, name).get('inputs') == _as_json(inputs))
    except DataError:
        return False


def write_result(study: Study, name: str, inputs: Inputs, result: Result) -> None:
    """Write a part's three files, which take their places once all are whole, JSON last."""
    study.out.mkdir(parents=True, exist_ok=True)
    command = study.command(name)
    content = {'title': result.title, 'command': command, 'inputs': dict(inputs),
               'tables': [table.to_dict() for table in result.tables],
               'claims': [{'claim': claim.claim, 'verdict': claim.verdict,
                           'because': claim.because} for claim in result.claims],
               'figures': dict(result.figures)}
    figures, page, picture = (study.out / f'{name}{suffix}' for suffix in _SUFFIXES)
    with (whole_file(figures) as json_file, whole_file(page) as markdown,
          whole_file(picture) as png):
        json_file.write_text(json.dumps(content, indent=1) + '\n')
        markdown.write_text(_markdown(name, command, inputs, result))
        Image.fromarray(result.picture).save(png, 'PNG', optimize=True)


def body(study: Study, name: str) -> str:
    """Return a part's Markdown without its provenance."""
    return (study.out / f'{name}.md').read_text().partition(f'\n\n{_MADE_BY}\n')[0]


def claims_of(found: Mapping[str, Any]) -> list[Claim]:
    """Return the claims in a part's JSON."""
    return [Claim(**claim) for claim in found['claims']]


def _markdown(name: str, command: str, inputs: Inputs, result: Result) -> str:
    blocks = [f'# {result.title}', result.text, f'![{result.title}]({name}.png)']
    for table in result.tables:
        blocks += [f'**{table.title}**', table.markdown()]
    if result.claims:
        blocks += ['Claims of the paper and targets, with the verdict of these measurements:',
                   sentences(result.claims)]
    blocks.append(_provenance(command, inputs))
    return '\n\n'.join(blocks) + '\n'


def _provenance(command: str, inputs: Inputs) -> str:
    """Return the provenance in Markdown: command, data, seed and weights."""
    lines = [f'- command: `{command}`']
    for key, value in inputs.items():
        if isinstance(value, Mapping):
            lines += [f'- {key} {name}: {_short(entry)}' for name, entry in value.items()]
        elif value is not None:
            lines.append(f'- {key}: {_short(value)}')
    return '\n'.join([_MADE_BY, '', *lines])


def _short(value: Any) -> str:
    """Return a value as text; hashes are shortened, since the JSON has them in full."""
    if isinstance(value, Mapping):
        return ', '.join(f'{key} {_short(entry)}' for key, entry in value.items())
    text = str(value)
    is_hash = len(text) == 64 and set(text) <= set('0123456789abcdef')
    return f'`{text[:12]}`' if is_hash else text


def _as_json(inputs: Inputs) -> Any:
    return json.loads(json.dumps(dict(inputs)))

