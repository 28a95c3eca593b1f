"""What all parts of one cabinet share: its colours, its boards, the make of its fronts."""

from dataclasses import dataclass

from active_recon.shapes.common.materials import glass, metal, paint, plastic, wood
from active_recon.shapes.common.parts import Color
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Style:
    """What all bays of one piece of furniture share; lengths in metres."""

    body: Color
    inside: Color
    top: Color
    fronts: tuple[Color, ...]  # taken in turn
    panel: Color
    handle: Color
    glass: Color
    board: float  # the thickness of boards
    face: str  # slab, frame, raised, louvre or planks
    grip: str  # knob, bar, block, cup, slot, rail, plate or none
    gap: float  # between a front and the centre lines round its bay
    proud: float  # how far fronts stand out of the carcass
    grip_size: float
    grip_level: float  # how far up a door its handle is, of its height
    panes: tuple[int, int]  # columns and rows of the panes of a glass door


def lacquer(rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a paint as furniture has it: any, but seldom garish."""
    muted = rng.uniform(0, 0.75)
    return (1 - muted) * paint(rng) + muted * rng.uniform(90, 235)


def draw_style(rng: np.random.Generator, longest: float) -> Style:
    """Return a style for a piece of furniture whose longest side is known."""
    body = [wood, wood, wood, plastic, plastic, lacquer][rng.integers(6)](rng)
    front = body * rng.uniform(0.9, 1.1)
    if rng.random() < 0.4:
        front = [wood, wood, plastic, lacquer][rng.integers(4)](rng)
    many = (lacquer(rng), lacquer(rng), front) if rng.random() < 0.06 else (front,)
    accent = [wood, lacquer, plastic][rng.integers(3)](rng)
    board = longest * rng.uniform(0.025, 0.034)
    handle = metal(rng) if rng.random() < 0.65 else accent * rng.uniform(0.3, 1)
    overlay = rng.random() < 0.5
    return Style(
        body=body, inside=body * rng.uniform(0.7, 1) if rng.random() < 0.75 else accent,
        top=body if rng.random() < 0.6 else accent, fronts=many,
        panel=front * rng.uniform(0.8, 1) if rng.random() < 0.8 else accent, handle=handle,
        glass=glass(rng), board=board,
        face=rng.choice(['slab', 'frame', 'raised', 'louvre', 'planks'],
                        p=[0.46, 0.24, 0.17, 0.05, 0.08]),
        grip=rng.choice(['knob', 'bar', 'block', 'cup', 'slot', 'rail', 'plate', 'none'],
                        p=[0.27, 0.2, 0.14, 0.06, 0.1, 0.06, 0.07, 0.1]),
        gap=-board * 0.22 if overlay else board * rng.uniform(0.25, 0.9),
        proud=longest * rng.uniform(0.006, 0.018), grip_size=longest * rng.uniform(0.012, 0.02),
        grip_level=rng.uniform(0.45, 0.85),
        panes=(int(rng.integers(1, 3)), int(rng.integers(1, 5))))
