"""Depth as cameras measure it: steps, holes, flying pixels and a scale that is slightly wrong."""

from collections.abc import Iterable
from dataclasses import dataclass

from active_recon.geometry.cameras import Camera
from active_recon.volumes.depth_evidence import depth_evidence, Evidence, no_evidence
from active_recon.volumes.voxels import FINE_RESOLUTION
import cv2
import numpy as np
from numpy.typing import NDArray

Depth = NDArray[np.float32]
_JUMP = 0.03  # depth, relative, between neighbours on two sides of an edge
_BLOCK = np.ones((3, 3), np.uint8)


@dataclass(frozen=True)
class DepthFaults:
    """
    What a depth camera does wrong; 0 everywhere: nothing.

    - scale: factor of all depths, less 1
    - step: distance of two depths that it can tell apart, in the unit of depth
    - noise: standard deviation of each depth, in that unit
    - edge_holes: share of the pixels beside an edge that have no value
    - flying: share of the pixels beside an edge whose depth lies between the edge's two sides
    - grazing: cosine between surface and ray below which there is no value
    - shiny: half angle, radians, of the directions in which surfaces reflect the camera's light
      so that there is no value
    - lost: share of all pixels that have no value
    """

    scale: float = 0.0
    step: float = 0.0
    noise: float = 0.0
    edge_holes: float = 0.0
    flying: float = 0.0
    grazing: float = 0.0
    shiny: float = 0.0
    lost: float = 0.0


def draw_depth_faults(rng: np.random.Generator) -> DepthFaults:
    """Return the faults of a random camera, of lengths in sides of the cube that it looks at."""
    return DepthFaults(
        scale=rng.uniform(-0.01, 0.01), step=rng.uniform(0.0005, 0.01),
        noise=rng.uniform(0, 0.006), edge_holes=rng.uniform(0, 0.8), flying=rng.uniform(0, 0.4),
        grazing=rng.uniform(0, 0.3), shiny=rng.uniform(0, 0.4) * (rng.random() < 0.6),
        lost=rng.uniform(0, 0.05))


def measured_evidence(views: Iterable[tuple[Depth, Camera]], faults: DepthFaults,
                      rng: np.random.Generator, side: int = FINE_RESOLUTION) -> Evidence:
    """Return the evidence of true depths (H, W) as one camera with faults measures them."""
    evidence = no_evidence(side)
    for depth, camera in views:
        evidence += depth_evidence(measured_depth(depth, camera.intrinsics.fx, faults, rng),
                                   camera, side)
    return evidence


def measured_depth(depth: Depth, focal: float, faults: DepthFaults,
                   rng: np.random.Generator) -> Depth:
    """
    Return what a camera with faults measures of true depth (H, W); 0 is no value in both.

    `focal` is the focal length in pixels. `rng` is the only source of randomness.
    """
    valid = depth > 0
    near, far = _around(depth)
    alone = cv2.erode(valid.astype(np.uint8), _BLOCK) == 0  # beside nothing
    edge = valid & (alone | (far - near > _JUMP * depth))
    found = depth * np.float32(1 + faults.scale)
    if faults.flying:
        between = near + (far - near) * rng.random(depth.shape, np.float32)
        flies = edge & (rng.random(depth.shape, np.float32) < faults.flying)
        found = np.where(flies, between * np.float32(1 + faults.scale), found)
    if faults.noise:
        found = found + np.float32(faults.noise) * rng.standard_normal(depth.shape, np.float32)
    if faults.step:
        found = np.rint(found / faults.step).astype(np.float32) * np.float32(faults.step)
    kept = valid & (rng.random(depth.shape, np.float32) >= faults.lost)
    kept &= ~(edge & (rng.random(depth.shape, np.float32) < faults.edge_holes))
    if faults.grazing or faults.shiny:
        normals = surface_normals(depth, focal)
        kept &= ~valid | (np.abs(_towards_camera(normals, focal)) >= faults.grazing)
        if faults.shiny:
            shines = rng.standard_normal(3) * [0.5, 0.5, 0] - [0, 0, 1]
            shines = (shines / np.linalg.norm(shines)).astype(np.float32)
            kept &= np.abs(normals @ shines) <= np.cos(faults.shiny)
    return np.where(kept, np.maximum(found, 0), 0).astype(np.float32)


def surface_normals(depth: Depth, focal: float) -> NDArray[np.float32]:
    """Return unit normals (H, W, 3) in the optical frame, by differences of neighbours."""
    across, down = cv2.Sobel(depth, cv2.CV_32F, 1, 0) / 8, cv2.Sobel(depth, cv2.CV_32F, 0, 1) / 8
    column, row = _slopes(depth.shape, focal)
    # What is at right angles to how the point of a pixel moves across and down the image
    forward = np.maximum(depth, 1e-6) / np.float32(focal) + column * across + row * down
    normals = np.stack([across, down, -forward], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.float32)


def with_plane(depth: Depth, rays: NDArray[np.float64], position: NDArray[np.float64],
               normal: NDArray[np.float64], offset: float) -> Depth:
    """
    Return depth (H, W) with the plane of points x where normal . x = offset behind or before it.

    `rays` (H, W, 3), of depth 1, and `position` (3,) are those of the camera, in the plane's
    frame and unit.
    """
    approach = rays @ normal
    with np.errstate(divide='ignore', invalid='ignore'):
        plane = np.where(approach != 0, (offset - position @ normal) / approach, 0)
    plane = np.where(plane > 0, plane, np.inf)
    nearer = np.minimum(np.where(depth > 0, depth, np.inf), plane)
    return np.where(np.isfinite(nearer), nearer, 0).astype(np.float32)


def _around(depth: Depth) -> tuple[Depth, Depth]:
    """Return the lowest and the highest depth of each pixel and its neighbours that have one."""
    near = cv2.erode(np.where(depth > 0, depth, np.float32(1e9)), _BLOCK)
    return np.asarray(np.minimum(near, depth)), np.asarray(cv2.dilate(depth, _BLOCK))


def _towards_camera(normals: NDArray[np.float32], focal: float) -> NDArray[np.float32]:
    """Return the cosine between normals (H, W, 3) and the rays of their pixels, (H, W)."""
    column, row = _slopes(normals.shape, focal)
    towards = normals[..., 0] * column + normals[..., 1] * row + normals[..., 2]
    return np.asarray(towards / np.sqrt(column ** 2 + row ** 2 + 1), np.float32)


def _slopes(shape: tuple[int, ...], focal: float) -> tuple[NDArray[np.float32], ...]:
    """Return how far the rays of columns (W,) and rows (H, 1) lead aside, per unit of depth."""
    column, row = (((np.arange(count) + 0.5 - count / 2) / focal).astype(np.float32)
                   for count in (shape[1], shape[0]))
    return column, row[:, None]
