"""Firearms, as shapes: rifles, shotguns, carbines, machine guns, pistols and old muskets."""

from collections.abc import Callable

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, Mesh, mirrored, rod
from active_recon.shapes.firearm.parts import (
    barrel,
    Coats,
    draw_coats,
    grip,
    magazine,
    plate,
    sight,
    stock,
    trigger,
)
import numpy as np


def firearm(rng: np.random.Generator) -> Mesh:
    """Return a random firearm; its barrel points along +x."""
    kinds: dict[Callable[[np.random.Generator, Coats], Mesh], float] = {
        _assault: 0.34, _hunting: 0.2, _shotgun: 0.09, _carbine: 0.1, _pistol: 0.08,
        _revolver: 0.04, _bullpup: 0.06, _machine_gun: 0.05, _musket: 0.04}
    return choose(rng, kinds)(rng, draw_coats(rng))


def _receiver(rng: np.random.Generator, low: float, high: float, back: float, front: float,
              width: float, coats: Coats) -> Mesh:
    """Return the body: a profile in (x, z) with cut corners, so thick in y."""
    cut = (high - low) * rng.uniform(0.1, 0.4)
    outline = [[back, low + cut * rng.uniform(0, 1)], [back + cut, low], [front - cut, low],
               [front, low + cut * 0.6], [front, high - cut * 0.3], [front - cut, high],
               [back + cut * 0.5, high], [back, high - cut]]
    return plate(outline, width, coats.body)


def _assault(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a rifle with a magazine before the grip, a handguard and a stock."""
    width = rng.uniform(0.045, 0.07)
    front = rng.uniform(0.12, 0.22)
    high = rng.uniform(0.03, 0.05)
    guard = front + rng.uniform(0.2, 0.32)
    muzzle = guard + rng.uniform(0.06, 0.26)
    tall = rng.uniform(0.05, 0.075)
    parts = [
        _receiver(rng, -0.045, high, -0.18, front, width, coats),
        box([front - 0.01, -width * 0.5, high - tall], [guard, width * 0.5, high * 0.9],
            coats.furniture),
        barrel(rng, 0.0, guard - 0.02, muzzle, rng.uniform(0.013, 0.017), coats),
        grip(rng, -0.11, -0.03, width, coats), trigger(-0.03, -0.04, width, coats),
        magazine(rng, rng.uniform(0.0, 0.06), -0.03, width, coats),
        stock(rng, -0.17, width, coats)]
    if rng.random() < 0.75:
        parts.append(sight(rng, -0.04, high, width, coats))
    if rng.random() < 0.5:  # a front sight or a gas tube above the barrel
        parts.append(box([guard - 0.03, -0.013, 0.0], [guard + 0.01, 0.013, high + 0.045],
                         coats.metal))
    if rng.random() < 0.2:
        at = guard - 0.08
        parts.append(box([at - 0.02, -0.02, high - tall - 0.1], [at + 0.02, 0.02,
                                                                high - tall + 0.01], coats.body))
    if rng.random() < 0.18:
        under = high - tall
        parts.append(rod([front + 0.02, 0, under - 0.012], [guard + 0.04, 0, under - 0.012], 0.03,
                         coats.metal))
    return assemble(parts)


def _hunting(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a bolt-action or a marksman's rifle: one long stock, often a scope and a bipod."""
    width = rng.uniform(0.04, 0.06)
    fore = rng.uniform(0.22, 0.45)
    muzzle = fore + rng.uniform(0.15, 0.4)
    drop = rng.uniform(0.03, 0.08)
    outline = [[-0.46, -drop - 0.075], [-0.17, -0.055], [-0.11, -0.05], [fore, -0.025],
               [fore, 0.01], [-0.14, 0.012], [-0.2, -drop * 0.4], [-0.46, -drop + 0.045]]
    parts = [plate(outline, width, coats.furniture),
             box([-0.14, -width * 0.42, -0.01], [0.1, width * 0.42, 0.04], coats.metal),
             barrel(rng, 0.018, 0.08, muzzle, rng.uniform(0.012, 0.019), coats),
             trigger(-0.09, -0.045, width, coats)]
    if rng.random() < 0.5:
        parts.append(rod([-0.1, 0, 0.02], [-0.12, -width * 1.4, -0.01], 0.012, coats.metal))
    if rng.random() < 0.65:
        parts.append(sight(rng, -0.02, 0.04, width, coats, scope=0.85))
    if rng.random() < 0.35:
        parts.append(box([0.0, -width * 0.4, -0.11], [0.07, width * 0.4, -0.03], coats.metal))
    if rng.random() < 0.25:
        parts.append(_bipod(rng, fore - 0.03, -0.01, coats))
    if rng.random() < 0.2:
        parts.append(plate([[-0.4, -drop + 0.02], [-0.24, -drop], [-0.25, 0.02], [-0.4, 0.03]],
                           width * 0.8, coats.body))
    return assemble(parts)


def _bipod(rng: np.random.Generator, x: float, z: float, coats: Coats) -> Mesh:
    tall, out = rng.uniform(0.13, 0.22), rng.uniform(0.05, 0.1)
    head = box([x - 0.025, -0.02, z - 0.03], [x + 0.025, 0.02, z + 0.01], coats.metal)
    return assemble([head, mirrored(rod([x, 0.0, z - 0.015], [x + 0.02, out, z - tall], 0.012,
                                        coats.metal))])


def _shotgun(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a pump gun or a double-barrelled one."""
    width, muzzle = rng.uniform(0.045, 0.06), rng.uniform(0.5, 0.66)
    radius = rng.uniform(0.015, 0.02)
    parts = [_receiver(rng, -0.045, 0.035, -0.14, 0.06, width, coats),
             trigger(-0.06, -0.04, width, coats), stock(rng, -0.13, width, coats, solid=0.85)]
    if rng.random() < 0.4:
        parts += [mirrored(rod([0.04, radius, 0.012], [muzzle, radius, 0.012], radius,
                               coats.metal)),
                  plate([[0.05, -0.045], [0.3, -0.03], [0.3, 0.0], [0.05, 0.005]], width,
                        coats.furniture)]
    else:
        tube = muzzle * rng.uniform(0.65, 0.98)
        parts += [rod([0.04, 0, 0.018], [muzzle, 0, 0.018], radius, coats.metal),
                  rod([0.04, 0, -0.02], [tube, 0, -0.02], radius, coats.metal)]
        start = rng.uniform(0.14, 0.24)
        parts.append(box([start, -width * 0.5, -0.05], [start + 0.16, width * 0.5, 0.0],
                         coats.furniture))
        parts.append(box([tube - 0.03, -radius, -0.025], [tube, radius, 0.02], coats.metal))
    return assemble(parts)


def _carbine(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a submachine gun: short, boxy or a tube, with a long magazine."""
    width, front = rng.uniform(0.05, 0.075), rng.uniform(0.14, 0.26)
    high = rng.uniform(0.03, 0.045)
    if rng.random() < 0.5:
        body = _receiver(rng, -0.04, high, -0.2, front, width, coats)
    else:
        body = assemble([rod([-0.22, 0, 0.0], [front, 0, 0.0], width * 0.55, coats.body),
                         box([-0.14, -width * 0.35, -0.05], [front * 0.6, width * 0.35, 0.0],
                             coats.body)])
    muzzle = front + rng.uniform(0.04, 0.18)
    through = rng.random() < 0.25  # the magazine goes through the grip
    well = -0.08 if through else rng.uniform(0.03, 0.09)
    parts = [body, barrel(rng, 0.0, front - 0.02, muzzle, rng.uniform(0.013, 0.018), coats),
             magazine(rng, well, -0.03, width * 0.8, coats), trigger(-0.02, -0.04, width, coats)]
    parts.append(grip(rng, -0.09, -0.03, width, coats))
    if rng.random() < 0.7:
        parts.append(stock(rng, -0.19, width * 0.8, coats, solid=0.25))
    if rng.random() < 0.35:
        parts.append(grip(rng, front - 0.04, -0.03, width * 0.8, coats))
    if rng.random() < 0.4:
        parts.append(sight(rng, 0.0, high * 0.9, width, coats))
    return assemble(parts)


def _pistol(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a pistol: a slide on a frame, the grip leaning back."""
    width, length = rng.uniform(0.075, 0.11), rng.uniform(0.8, 1.1)
    tall = rng.uniform(0.13, 0.18)
    slide = box([-0.25, -width / 2, 0.0], [length - 0.3, width / 2, tall], coats.metal)
    frame = plate([[-0.23, 0.02], [-0.2, -0.08], [length * 0.5, -0.06], [length - 0.36, 0.02]],
                  width * 0.9, coats.body)
    lean, drop = rng.uniform(0.08, 0.2), rng.uniform(0.42, 0.55)
    handle = plate([[-0.22, 0.03], [0.02, 0.03], [-lean + 0.05, -drop], [-lean - 0.2, -drop]],
                   width * 1.05, coats.furniture)
    guard = trigger(0.08, -0.05, width, coats, size=3.0)
    parts = [slide, frame, handle, guard]
    if rng.random() < 0.25:
        parts.append(rod([length - 0.32, 0, tall * 0.6], [length + rng.uniform(0.1, 0.4), 0,
                                                         tall * 0.6], width * 0.4, coats.metal))
    return assemble(parts)


def _revolver(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a revolver: a drum, a barrel and a bent grip."""
    width, length = rng.uniform(0.05, 0.07), rng.uniform(0.25, 0.75)
    drum = rod([-0.05, 0, 0.0], [0.17, 0, 0.0], rng.uniform(0.085, 0.11), coats.metal, sections=8)
    frame = plate([[-0.16, -0.09], [0.2, -0.13], [0.22, 0.12], [-0.1, 0.12], [-0.18, 0.05]], width,
                  coats.body)
    tube = rod([0.15, 0, 0.06], [0.2 + length, 0, 0.06], 0.04, coats.metal)
    under = box([0.18, -0.025, -0.03], [0.2 + length * rng.uniform(0.3, 0.95), 0.025, 0.05],
                coats.metal)
    handle = plate([[-0.18, 0.06], [-0.05, -0.08], [-0.15, -0.4], [-0.34, -0.38], [-0.24, -0.1]],
                   width * 1.5, coats.furniture)
    return assemble([drum, frame, tube, under, handle, trigger(0.0, -0.1, width, coats, 2.4)])


def _bullpup(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a rifle whose works lie in its stock, behind the grip."""
    width, muzzle = rng.uniform(0.05, 0.075), rng.uniform(0.42, 0.6)
    front = rng.uniform(0.2, 0.32)
    body = plate([[-0.45, -0.11], [-0.3, -0.1], [-0.05, -0.04], [front, -0.045], [front, 0.03],
                  [-0.1, 0.05], [-0.45, 0.05]], width, coats.body)
    rail = box([-0.12, -width * 0.3, 0.04], [front * 0.8, width * 0.3, 0.07], coats.metal)
    parts = [body, rail, barrel(rng, 0.0, front - 0.02, muzzle, 0.016, coats),
             grip(rng, 0.0, -0.03, width, coats), trigger(0.06, -0.035, width, coats),
             magazine(rng, -0.25, -0.09, width, coats)]
    parts.append(sight(rng, 0.0, 0.065, width, coats, scope=0.6))
    return assemble(parts)


def _machine_gun(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a machine gun on two legs, fed from a box or a drum."""
    width, front = rng.uniform(0.06, 0.085), rng.uniform(0.12, 0.2)
    muzzle = rng.uniform(0.5, 0.68)
    case = (rod([0.03, -0.07, -0.07], [0.03, 0.07, -0.07], rng.uniform(0.05, 0.075), coats.metal,
                sections=16) if rng.random() < 0.4 else
            box([-0.03, -0.06, -0.14], [0.1, 0.06, -0.02], coats.furniture))
    parts = [_receiver(rng, -0.05, 0.045, -0.2, front, width, coats), case,
             rod([front - 0.02, 0, 0.005], [front + 0.2, 0, 0.005], 0.028, coats.metal),
             barrel(rng, 0.005, front, muzzle, 0.018, coats),
             _bipod(rng, muzzle - rng.uniform(0.08, 0.2), 0.005, coats),
             grip(rng, -0.13, -0.035, width, coats), stock(rng, -0.19, width, coats, solid=0.7)]
    if rng.random() < 0.5:
        parts.append(box([-0.05, -0.02, 0.035], [0.08, 0.02, 0.1], coats.body))
    return assemble(parts)


def _musket(rng: np.random.Generator, coats: Coats) -> Mesh:
    """Return a musket: stocked almost to the muzzle, a lock at the side, a drooping butt."""
    width, muzzle = rng.uniform(0.028, 0.04), 0.72
    fore = muzzle - rng.uniform(0.03, 0.2)
    outline = [[-0.38, -0.13], [-0.16, -0.045], [fore, -0.022], [fore, 0.008], [-0.12, 0.012],
               [-0.2, -0.01], [-0.38, -0.03]]
    return assemble([
        plate(outline, width, coats.furniture),
        rod([-0.12, 0, 0.012], [muzzle, 0, 0.012], 0.014, coats.metal),
        box([-0.1, -width * 0.9, -0.025], [0.0, -width * 0.3, 0.02], coats.metal),
        rod([-0.07, -width * 0.8, 0.0], [-0.1, -width * 0.8, 0.06], 0.011, coats.metal),
        trigger(-0.09, -0.035, width, coats)])
