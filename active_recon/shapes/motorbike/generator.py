"""Motorbikes: cruisers, choppers, tourers, sport, naked and dirt bikes, scooters; off to +x."""

from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Mesh
from active_recon.shapes.motorbike.light import dirt, scooter
from active_recon.shapes.motorbike.parts import Chassis, Livery
from active_recon.shapes.motorbike.road import road
import numpy as np

_Range = tuple[float, float]

# wheelbase, radii of the front and the rear wheel, rake [m a m], height of the head, of the
# seat, tyres' widths (front, rear), clearance [m]
_KINDS: dict[str, tuple[_Range, ...]] = {
    'cruiser': ((1.5, 1.7), (0.3, 0.35), (0.3, 0.34), (0.55, 0.75), (0.85, 0.98), (0.64, 0.72),
                (0.11, 0.16), (0.15, 0.22), (0.13, 0.18)),
    'chopper': ((1.65, 2.0), (0.32, 0.37), (0.29, 0.34), (0.75, 1.05), (0.9, 1.08),
                (0.58, 0.68), (0.09, 0.12), (0.19, 0.28), (0.12, 0.17)),
    'tourer': ((1.5, 1.7), (0.3, 0.34), (0.29, 0.33), (0.48, 0.65), (0.9, 1.0), (0.7, 0.78),
               (0.12, 0.16), (0.16, 0.21), (0.13, 0.18)),
    'sport': ((1.35, 1.45), (0.29, 0.32), (0.29, 0.33), (0.4, 0.5), (0.84, 0.92), (0.78, 0.86),
              (0.11, 0.14), (0.17, 0.22), (0.13, 0.18)),
    'naked': ((1.35, 1.5), (0.29, 0.34), (0.29, 0.33), (0.45, 0.55), (0.88, 0.96),
              (0.74, 0.82), (0.1, 0.14), (0.13, 0.2), (0.15, 0.2)),
    'dirt': ((1.3, 1.5), (0.34, 0.39), (0.31, 0.35), (0.45, 0.56), (1.0, 1.12), (0.88, 0.98),
             (0.08, 0.11), (0.1, 0.14), (0.28, 0.36)),
    'scooter': ((1.15, 1.4), (0.2, 0.26), (0.2, 0.26), (0.4, 0.55), (0.86, 0.98), (0.72, 0.8),
                (0.1, 0.13), (0.1, 0.14), (0.17, 0.23)),
}
_WEIGHTS = {'cruiser': 5, 'chopper': 3, 'tourer': 3, 'sport': 6, 'naked': 5, 'dirt': 4,
            'scooter': 5}


def motorbike(rng: np.random.Generator) -> Mesh:
    """Return a random motorbike, about two metres long, standing on z = 0."""
    kind = choose(rng, _WEIGHTS)
    chassis = _chassis(rng, kind)
    livery = _livery(rng, kind)
    if kind == 'scooter':
        return assemble(scooter(rng, chassis, livery))
    if kind == 'dirt':
        return assemble(dirt(rng, chassis, livery))
    return assemble(road(rng, kind, chassis, livery))


def _chassis(rng: np.random.Generator, kind: str) -> Chassis:
    base, front, rear, rake, head, seat, thin, wide, clearance = (
        rng.uniform(*span) for span in _KINDS[kind])
    axle = base / 2
    head_x = axle - rake * (head - front)
    back = 0.22 if kind in ('cruiser', 'chopper', 'tourer') else 0.32
    return Chassis(front=(axle, front), rear=(-axle, rear), head=(head_x, head),
                   seat=(-axle + back, seat), widths=(thin, wide), clearance=clearance)


def _livery(rng: np.random.Generator, kind: str) -> Livery:
    if rng.random() < 0.04:  # an untextured model
        return Livery(*[np.full(3, rng.uniform(90, 220))] * 9)
    paint = materials.paint(rng)
    dark = np.full(3, rng.uniform(15, 70))
    shine = np.full(3, rng.uniform(140, 235))
    plain = kind in ('sport', 'naked', 'dirt')
    return Livery(
        paint=paint, second=materials.paint(rng) if rng.random() < 0.4 else paint,
        frame=paint if rng.random() < 0.2 else (dark, materials.metal(rng))[rng.integers(2)],
        chrome=materials.metal(rng) if plain else shine, engine=materials.metal(rng),
        seat=dark if rng.random() < 0.7 else materials.fabric(rng) * 0.7,
        tyre=materials.rubber(rng),
        rim=(materials.metal(rng), shine, dark, paint)[rng.integers(4)],
        glass=materials.glass(rng))
