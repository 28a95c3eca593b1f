"""All parts of the document in reading order; a part is made if its inputs have changed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from active_recon.errors import ConfigError
from active_recon.paper import examples, figures, policies, table1, table2, table3, table4, table5
from active_recon.paper.results import Result
from active_recon.paper.study import Study
from active_recon.paper.writing import Inputs, is_current, write_result


@dataclass(frozen=True)
class Part:
    """The functions for a part's inputs and its result, and the parts that it depends on."""

    inputs: Callable[[Study], Inputs]
    make: Callable[[Study], Result]
    after: tuple[str, ...] = ()


PARTS: Mapping[str, Part] = {
    'table1': Part(table1.inputs, table1.make),
    'fig5': Part(figures.inputs5, figures.make5, after=('table1',)),
    'table2': Part(table2.inputs, table2.make),
    'table3': Part(table3.inputs, table3.make),
    'fig6': Part(figures.inputs6, figures.make6),
    'fig7': Part(examples.inputs7, examples.make7),
    'fig8': Part(examples.inputs8, examples.make8),
    'policies': Part(policies.inputs, policies.make),
    'fig9': Part(figures.inputs9, figures.make9),
    'table4': Part(table4.inputs, table4.make),
    'fig10': Part(figures.inputs10, figures.make10),
    'table5': Part(table5.inputs, table5.make),
    'fig11': Part(examples.inputs11, examples.make11),
}


def run_part(study: Study, name: str, again: bool = False) -> bool:
    """
    Make a part and write it, unless it is current; return whether it was made.

    Missing systems are trained first. A part is current if its files exist and were made from
    the same inputs; `again` makes it anyway. Raises ConfigError on an unknown part.
    """
    if name not in PARTS:
        raise ConfigError(f'no such part: expected one of {", ".join(PARTS)}, got {name!r}')
    part = PARTS[name]
    for earlier in part.after:
        run_part(study, earlier)
    inputs = part.inputs(study)
    if is_current(study, name, inputs) and not again:
        return False
    write_result(study, name, inputs, part.make(study))
    return True
