"""Cars, from microcars to lorries."""

from dataclasses import replace

from active_recon.shapes.car import fittings
from active_recon.shapes.car.bodies import greenhouse, hull, Livery, Stance, walls
from active_recon.shapes.car.open import formula, roadster_fittings
from active_recon.shapes.car.working import lorry, pickup_fittings, vintage
from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, Mesh
import numpy as np
import trimesh

_Range = tuple[float, float]

# length, width, height [m]; belt [of the height]; then x of the windscreen's foot and head and
# the rear window's head and foot [of the length, from the middle]; sides' windows.
_KINDS: dict[str, tuple[_Range, _Range, _Range, _Range, _Range, _Range, _Range, _Range]] = {
    'sedan': ((4.2, 5.3), (1.7, 1.95), (1.35, 1.55), (0.6, 0.7),
              (0.17, 0.27), (0.02, 0.11), (-0.26, -0.18), (-0.39, -0.3)),
    'hatchback': ((3.5, 4.4), (1.6, 1.85), (1.38, 1.6), (0.58, 0.68),
                  (0.2, 0.32), (0.05, 0.14), (-0.43, -0.33), (-0.49, -0.44)),
    'micro': ((2.5, 3.4), (1.4, 1.65), (1.4, 1.7), (0.54, 0.66),
              (0.2, 0.38), (0.06, 0.2), (-0.38, -0.25), (-0.48, -0.4)),
    'estate': ((4.3, 5.1), (1.7, 1.9), (1.4, 1.6), (0.6, 0.68),
               (0.17, 0.27), (0.03, 0.12), (-0.46, -0.38), (-0.495, -0.47)),
    'coupe': ((3.9, 4.9), (1.7, 2.05), (1.08, 1.4), (0.6, 0.72),
              (0.08, 0.28), (-0.06, 0.04), (-0.22, -0.13), (-0.47, -0.34)),
    'suv': ((3.7, 5.1), (1.75, 2.1), (1.65, 2.1), (0.56, 0.68),
            (0.18, 0.29), (0.09, 0.2), (-0.47, -0.4), (-0.495, -0.475)),
    'van': ((4.2, 6.0), (1.8, 2.1), (1.9, 2.7), (0.42, 0.58),
            (0.33, 0.48), (0.22, 0.34), (-0.485, -0.46), (-0.495, -0.485)),
    'bus': ((7.0, 11.0), (2.2, 2.6), (2.6, 3.3), (0.4, 0.52),
            (0.465, 0.49), (0.43, 0.475), (-0.485, -0.47), (-0.495, -0.485)),
    'pickup': ((4.6, 5.8), (1.75, 2.1), (1.6, 2.0), (0.58, 0.66),
               (0.19, 0.28), (0.09, 0.17), (-0.17, -0.03), (-0.2, -0.06)),
    'roadster': ((3.6, 4.9), (1.6, 1.95), (1.15, 1.5), (0.6, 0.72),
                 (0.08, 0.22), (-0.02, 0.08), (-0.25, -0.15), (-0.34, -0.25)),
    'jeep': ((3.3, 4.3), (1.6, 1.9), (1.6, 1.9), (0.54, 0.64),
             (0.14, 0.24), (0.1, 0.16), (-0.42, -0.36), (-0.46, -0.42)),
}
_SPECIAL = {'formula': formula, 'lorry': lorry, 'vintage': vintage}
_WEIGHTS = {'sedan': 5, 'hatchback': 4, 'micro': 2, 'estate': 3, 'coupe': 5, 'suv': 4, 'van': 4,
            'bus': 1, 'pickup': 3, 'roadster': 3, 'jeep': 1, 'formula': 2, 'lorry': 3,
            'vintage': 2}
_TALL = ('suv', 'van', 'bus', 'pickup', 'jeep')


def car(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a random car: about four metres long, its bonnet at +x, standing on z = 0."""
    kind = choose(rng, _WEIGHTS)
    livery = _livery(rng)
    if kind in _SPECIAL:
        return assemble(_SPECIAL[kind](rng, livery))
    stance = _stance(rng, kind)
    duty = rng.choice(['private', 'taxi', 'police'], p=[0.84, 0.07, 0.09])
    if kind in ('roadster', 'jeep', 'bus', 'pickup'):
        duty = 'private'
    if duty == 'police':
        livery = replace(livery, doors=(240, 240, 240), roof=(240, 240, 240),
                         paint=materials.paint(rng) * rng.uniform(0.1, 1))
    elif duty == 'taxi' and rng.random() < 0.6:
        yellow = (245, rng.uniform(170, 210), rng.uniform(20, 70))
        livery = replace(livery, paint=yellow, doors=yellow, roof=yellow, stripe=yellow)
    parts = _body(rng, kind, stance, livery)
    parts += _running_gear(rng, kind, stance, livery)
    parts += fittings.lights(rng, stance, livery)
    if rng.random() < 0.75:
        color = (livery.trim, livery.paint, livery.sill)[rng.integers(3)]
        parts += fittings.bumpers(rng, stance, color)
    if rng.random() < 0.6:
        parts.append(fittings.mirrors(rng, stance, (livery.paint, livery.trim)[rng.integers(2)]))
    if duty == 'police':
        parts.append(fittings.light_bar(rng, stance))
    elif duty == 'taxi':
        parts.append(fittings.roof_sign(rng, stance, materials.paint(rng)))
    elif kind in ('suv', 'estate', 'van', 'hatchback') and rng.random() < 0.3:
        parts.append(fittings.roof_load(rng, stance, livery, materials.fabric(rng)))
    if kind in ('coupe', 'sedan', 'micro') and rng.random() < (0.5 if kind == 'coupe' else 0.15):
        parts.append(fittings.spoiler(rng, stance, (livery.paint, livery.trim)[rng.integers(2)]))
    return assemble(parts)


def _livery(rng: np.random.Generator) -> Livery:
    paint = materials.paint(rng)
    if rng.random() < 0.05:  # an untextured model
        grey = np.full(3, rng.uniform(90, 220))
        return Livery(*[grey] * 10)
    second = materials.paint(rng)
    trim = materials.metal(rng) if rng.random() < 0.4 else np.full(3, rng.uniform(20, 80))
    return Livery(
        paint=paint, roof=second if rng.random() < 0.15 else paint,
        doors=second if rng.random() < 0.06 else paint,
        stripe=second if rng.random() < 0.12 else paint,
        sill=trim if rng.random() < 0.6 else paint, trim=trim,
        glass=materials.glass(rng) if rng.random() < 0.7 else rng.uniform(
            (90, 180, 195), (210, 235, 250)),
        tyre=materials.rubber(rng),
        rim=materials.metal(rng) if rng.random() < 0.8 else materials.paint(rng),
        seat=materials.fabric(rng))


def _stance(rng: np.random.Generator, kind: str) -> Stance:
    length, width, height, belt, *places = (rng.uniform(*span) for span in _KINDS[kind])
    if rng.random() < 0.35:  # toys and low-poly games shorten everything but the wheels
        length *= rng.uniform(0.7, 0.95)
        height *= rng.uniform(1.0, 1.15)
    radius = rng.uniform(0.28, 0.37) * (1.15 if kind in _TALL else 1) * rng.uniform(0.95, 1.2)
    clearance = radius * rng.uniform(0.45, 0.7) * (1.25 if kind in _TALL else 0.9)
    belt *= height
    cowl, roof_front, roof_rear, back = (place * length for place in places)
    low = clearance + 0.3
    nose = max(belt * rng.uniform(0.72 if kind not in _TALL else 0.85, 1.0), low)
    front = length / 2 - radius - length * rng.uniform(0.04, 0.12)
    rear = -length / 2 + radius + length * rng.uniform(0.05, 0.16)
    return Stance(length=length, width=width, clearance=clearance, nose=nose, belt=belt,
                  deck=max(belt * rng.uniform(0.9, 1.03), low), roof=height, cowl=cowl,
                  roof_front=roof_front, roof_rear=roof_rear, back=back, axles=(front, rear),
                  wheel_radius=radius, smooth=rng.random() < (0.2 if kind == 'jeep' else 0.55),
                  plan_taper=rng.uniform(0, 0.14))


def _body(rng: np.random.Generator, kind: str, stance: Stance, livery: Livery) -> list[Mesh]:
    end = stance.length / 2
    floor = stance.clearance + (stance.belt - stance.clearance) * rng.uniform(0.35, 0.55)
    if kind in ('roadster', 'jeep'):
        well = (stance.back, stance.cowl - 0.1, floor)
        return [hull(stance, livery, well), *walls(stance, livery, well, 0.12),
                *roadster_fittings(rng, stance, livery, floor, kind == 'jeep')]
    tumblehome = rng.uniform(0.02, 0.12) if kind in _TALL else rng.uniform(0.08, 0.26)
    if kind == 'pickup':
        well = (-end + 0.1, stance.back - 0.08, floor)
        doors = 2 if stance.cowl - stance.back > 0.36 * stance.length else 1
        return [hull(stance, livery, well), *walls(stance, livery, well, 0.1),
                greenhouse(stance, livery, doors, tumblehome=tumblehome),
                *pickup_fittings(rng, stance, livery, well)]
    windows = {'coupe': 1, 'micro': 1, 'van': 3, 'bus': int(rng.integers(4, 8))}.get(
        kind, int(rng.integers(2, 4)))
    pillar = rng.uniform(0.06, 0.3) if kind in ('coupe', 'micro', 'sedan') else 0.06
    glazed = 1 if kind == 'van' and rng.random() < 0.55 else None
    return [hull(stance, livery),
            greenhouse(stance, livery, windows, glazed, pillar, tumblehome)]


def _running_gear(rng: np.random.Generator, kind: str, stance: Stance,
                  livery: Livery) -> list[Mesh]:
    radius = stance.wheel_radius
    width = radius * rng.uniform(0.5, 0.85)
    one = fittings.wheel(rng, radius, width, livery, 16 if stance.smooth else int(
        rng.integers(8, 15)))
    proud = rng.uniform(0.0, 0.06)
    parts: list[Mesh] = []
    places = []
    flare = (livery.trim, livery.paint, livery.tyre)[rng.integers(3)]
    for x in stance.axles:
        y = stance.half_width(x) + proud
        places.append((x, y - width / 2, radius))
        parts.append(fittings.arch(x, y - 0.02, radius, radius * rng.uniform(1.1, 1.22), width,
                                   flare))
        parts.append(box((x - 0.06, -y + width / 2, radius - 0.06),
                         (x + 0.06, y - width / 2, radius + 0.06), livery.trim))
    parts.append(fittings.wheels(one, places))
    if kind in ('suv', 'jeep') and rng.random() < 0.5:
        spare = fittings.wheel(rng, radius, width * 0.8, livery, 14)
        spare.apply_transform(np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0],
                                        [0, 0, 0, 1.0]]))
        spare.apply_translation((-stance.length / 2 - width * 0.35, 0, stance.belt * 0.85))
        parts.append(spare)
    return parts
