"""How the faces of cabinets are cut: drawers, doors and open bays, as real ones have them."""

from active_recon.shapes.cabinet.bays import Bay, columns, doors, rows
import numpy as np
from numpy.typing import NDArray

Bays = list[Bay]


def drawers(bay: Bay, count: int, shares: list[float] | None = None) -> Bays:
    """Return a column of drawers."""
    return rows(bay._replace(kind='drawer'), shares or count)


def chest(rng: np.random.Generator, face: Bay) -> Bays:
    """Return rows of drawers, often deeper below, or halved in the top row."""
    count = int(np.clip(round(face.height / rng.uniform(0.15, 0.3)), 2, 8))
    across = max(1, round(face.width / rng.uniform(0.5, 1.2)))
    if rng.random() < 0.12 and face.width > 0.7:  # a combination: a door beside the drawers
        left, right = columns(face, [1, rng.uniform(0.7, 1.5)])
        return [*doors(left, 1), *drawers(right, count)]
    grading = rng.choice([1, 1, 0.85, 0.75])
    bays = []
    split = rng.choice([0, 0, 1, 2]) if across < 3 else 0
    levels = rows(face._replace(kind='drawer'), [grading ** i for i in range(count)])
    for level, row in enumerate(levels):
        bays += columns(row, across + split * (level == count - 1))
    if rng.random() < 0.12 and count > 2:  # the top row is a ledge to put things on
        bays = [b._replace(kind='open') if b.high == levels[-1].high else b for b in bays]
    return bays


def bedside(rng: np.random.Generator, face: Bay) -> Bays:
    """Return a small cabinet's face: drawers, a door, a shelf, in any order that is used."""
    kind = rng.integers(7)
    if kind < 2:
        return drawers(face, int(rng.integers(1, 4)))
    if kind == 2:
        return doors(face, 1)
    low, high = rows(face, [rng.uniform(0.8, 2.2), 1])
    if kind == 3:
        return [*doors(low, 1), high._replace(kind='drawer')]
    if kind == 4:
        return [*drawers(low, int(rng.integers(1, 3))), high]
    if kind == 5:
        return [*doors(low, 1), high]
    return [low, high._replace(kind='drawer')]


def sideboard(rng: np.random.Generator, face: Bay) -> Bays:
    """Return columns of doors, drawers, panes and shelves, mostly alike on both sides."""
    count = int(np.clip(round(face.width / rng.uniform(0.35, 0.6)), 2, 6))
    shares = rng.choice([1, 1, 1.4], count)
    bays: Bays = []
    if rng.random() < 0.3:
        face, head = rows(face, [rng.uniform(2, 3.5), 1])
        bays += columns(head._replace(kind=rng.choice(['drawer', 'drawer', 'open'])), count)
    kinds = rng.choice(['door', 'door', 'door', 'drawers', 'drawers', 'open', 'glass', 'mixed'],
                       count)
    if rng.random() < 0.7:
        shares, kinds = np.minimum(shares, shares[::-1]), _mirror(kinds)
    for index, (bay, kind) in enumerate(zip(columns(face, shares.tolist()), kinds, strict=True)):
        bays += _column(rng, bay, kind, 1 if index % 2 == 0 else -1)
    return bays


def _mirror(kinds: NDArray[np.str_]) -> NDArray[np.str_]:
    half = len(kinds) // 2
    return np.concatenate([kinds[:len(kinds) - half], kinds[:half][::-1]])


def _column(rng: np.random.Generator, bay: Bay, kind: str, side: int) -> Bays:
    if kind == 'drawers':
        return drawers(bay, int(rng.integers(2, 5)))
    if kind == 'mixed':
        low, high = rows(bay, [rng.uniform(1, 3), 1])
        return [low._replace(kind='door', side=side), high._replace(
            kind=rng.choice(['drawer', 'open']))]
    if kind == 'open':
        return rows(bay, int(rng.integers(1, 4)))
    return [bay._replace(kind=kind, side=side)]


def media(rng: np.random.Generator, face: Bay) -> Bays:
    """Return the face of a stand for a television: low, and in part open."""
    count = int(rng.integers(1, 5))
    kind = rng.choice(['open', 'row', 'mixed', 'closed'])
    if kind == 'open':
        return [b for bay in columns(face, count) for b in rows(bay, int(rng.integers(1, 3)))]
    if kind == 'row':
        closed, gap = rows(face, [rng.uniform(0.7, 2), 1])
        if rng.random() < 0.25:
            closed, gap = gap, closed
        fronts = columns(closed._replace(kind=rng.choice(['drawer', 'drawer', 'door'])), count)
        return [*fronts, *columns(gap, int(rng.choice([1, count])))]
    sides = rng.choice(['door', 'drawers', 'glass', 'open']), rng.choice(
        ['open', 'open', 'drawers', 'door'])
    if kind == 'closed':
        sides = 'door', rng.choice(['door', 'drawers'])
    pattern = [sides[0], *[sides[1]] * int(rng.integers(1, 3)), sides[0]]
    if rng.random() < 0.25:
        pattern = pattern[:-1]
    shares = [1.0, *[rng.uniform(0.8, 1.8)] * (len(pattern) - 1)]
    if len(pattern) > 2 and pattern[-1] == pattern[0]:
        shares[-1] = 1.0
    return [b for index, (bay, name) in enumerate(
        zip(columns(face, shares), pattern, strict=True))
        for b in _column(rng, bay, name, -1 if index else 1)]


def wardrobe(rng: np.random.Generator, face: Bay) -> Bays:
    """Return tall doors, with drawers below, small doors above, or an open column."""
    count = max(1, round(face.width / rng.uniform(0.4, 0.6)))
    bays: Bays = []
    if rng.random() < 0.4:
        low, face = rows(face, [1, rng.uniform(2.5, 6)])
        wide = count if rng.random() < 0.4 else max(1, count // 2)
        bays += [b for bay in columns(low, wide) for b in drawers(bay, int(rng.integers(1, 3)))]
    if rng.random() < 0.18:
        face, high = rows(face, [rng.uniform(3, 5), 1])
        bays += doors(high, count)
    if count >= 2 and rng.random() < 0.15:
        return [*bays, face._replace(kind='sliding')]
    if count >= 2 and rng.random() < 0.25:
        cells = columns(face, count)
        at = count // 2 if count % 2 else int(rng.choice([0, count - 1]))
        shelf = cells.pop(at)
        bays += _shelved(rng, shelf)
        return bays + [cell._replace(kind='door', side=1 if i % 2 == 0 else -1)
                       for i, cell in enumerate(cells)]
    leaves = doors(face, count)
    if rng.random() < 0.2:
        middle = {(count - 1) // 2, count // 2}
        leaves = [leaf._replace(kind='mirror' if i in middle else 'door')
                  for i, leaf in enumerate(leaves)]
    return bays + leaves


def _shelved(rng: np.random.Generator, bay: Bay) -> Bays:
    """Return open shelves, perhaps over drawers."""
    if rng.random() < 0.4:
        return rows(bay, int(rng.integers(3, 6)))
    low, high = rows(bay, [1, rng.uniform(1, 2)])
    return [*drawers(low, int(rng.integers(2, 5))), *rows(high, int(rng.integers(1, 4)))]


def kitchen(rng: np.random.Generator, face: Bay) -> Bays:
    """Return a kitchen unit's columns: doors under drawers, stacks of drawers, tall doors."""
    count = max(1, round(face.width / rng.uniform(0.38, 0.6)))
    bays: Bays = []
    alike = rng.choice(['mixed', 'drawers', 'door']) if rng.random() < 0.4 else None
    for index, bay in enumerate(columns(face, count)):
        side, kind = 1 if index % 2 == 0 else -1, alike or rng.choice(
            ['mixed', 'mixed', 'drawers', 'door', 'open'], p=[0.3, 0.2, 0.25, 0.2, 0.05])
        if kind == 'mixed':
            low, high = rows(bay, [rng.uniform(2.5, 4), 1])
            bays += [low._replace(kind='door', side=side), high._replace(kind='drawer')]
        else:
            bays += _column(rng, bay, kind, side)
    return bays


def wall_unit(rng: np.random.Generator, face: Bay) -> Bays:
    """Return what hangs over a worktop or a basin: doors, panes, an open shelf."""
    count = max(1, round(face.width / rng.uniform(0.3, 0.5)))
    bays: Bays = []
    if rng.random() < 0.3:
        shelf, face = rows(face, [1, rng.uniform(1.5, 3)])
        bays.append(shelf)
    return bays + doors(face, count, rng.choice(['door', 'door', 'glass', 'mirror']))


def filing(rng: np.random.Generator, face: Bay) -> Bays:
    """Return an office's stack of deep drawers, some with a flat one on top."""
    count = max(1, round(face.height / rng.uniform(0.27, 0.36)))
    if rng.random() < 0.35:
        return drawers(face, count, [*[1.0] * count, 0.45])
    return drawers(face, count)


def lockers(rng: np.random.Generator, face: Bay) -> Bays:
    """Return a grid of equal doors."""
    across = max(1, round(face.width / rng.uniform(0.28, 0.42)))
    return [bay._replace(kind='door', side=1) for row in rows(face, int(rng.integers(1, 5)))
            for bay in columns(row, across)]


def vitrine(rng: np.random.Generator, face: Bay) -> Bays:
    """Return glass doors, mostly over drawers or doors."""
    count = max(1, round(face.width / rng.uniform(0.35, 0.6)))
    if rng.random() < 0.35:
        return doors(face, count, 'glass')
    low, high = rows(face, [1, rng.uniform(1, 2.5)])
    below = doors(low, count) if rng.random() < 0.5 else [
        b for bay in columns(low, max(1, count // 2)) for b in drawers(bay, int(
            rng.integers(1, 4)))]
    return [*below, *doors(high, count, 'glass')]
