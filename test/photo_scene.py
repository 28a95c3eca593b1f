"""Photos of a known object, rendered from known cameras over any background."""

import math

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.volumes.rendering import Renderer
import numpy as np
from photo_rigs import write_transforms
from PIL import Image
import trimesh

SIDE = 0.3
"""Of the object's longest side, metres."""
CENTRE = np.array([0.4, -0.3, 0.2])
LENS = Intrinsics(260.0, 260.0, 120.0, 90.0, 240, 180)
BACK = (40, 60, 200)


def thing():
    """Return an object without a symmetry, in a world with z up, about CENTRE."""
    parts = [trimesh.creation.box([0.3, 0.14, 0.08]), trimesh.creation.box([0.08, 0.12, 0.2]),
             trimesh.creation.icosphere(subdivisions=2, radius=0.05)]
    for part, place in zip(parts, ([0, 0, -0.06], [-0.1, 0, 0.05], [0.08, 0.02, 0.03]),
                           strict=True):
        part.apply_translation(place)
        part.visual.face_colors = [220, 180 - 60 * len(part.faces) % 100, 90, 255]
    whole = trimesh.util.concatenate(parts)
    whole.apply_translation(CENTRE - whole.bounds.mean(axis=0))
    return whole


def cameras(count=8, distance=0.9, lens=LENS):
    found = []
    for number in range(count):
        pose = orbit_camera(number * 2 * math.pi / count, 0.3 + 0.25 * (number % 3),
                            distance).pose.copy()
        pose[:3, 3] += CENTRE
        found.append(Camera(pose, lens))
    return found


def rendered(views):
    """Return the photos with straight alpha, (H, W, 4) uint8 each."""
    renderer = Renderer(thing())
    return [renderer.render(view) for view in views]


def on_plain(rgba, color=BACK):
    alpha = rgba[..., 3:].astype(np.float32) / 255
    return np.rint(rgba[..., :3] * alpha + np.array(color) * (1 - alpha)).astype(np.uint8)


def write_photos(folder, views, images):
    """Write photos and their transforms.json."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, image in enumerate(images):
        Image.fromarray(image).save(folder / f'photo{number}.png')
    write_transforms(folder / 'transforms.json', views)
    return folder
