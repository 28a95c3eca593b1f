"""Cameras around an object, written in the formats that tools exchange them in."""

import json
import math

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.lenses import Distortion
import cv2
import numpy as np
from PIL import Image

LENS = Intrinsics(300.0, 310.0, 161.0, 119.0, 320, 240,
                  Distortion('plumb_bob', (0.05, -0.02, 0.001, -0.002)))
PINHOLE = Intrinsics(300.0, 300.0, 160.0, 120.0, 320, 240)
CENTRE = np.array([0.4, -0.3, 0.2])
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def rig(lens=LENS, count=4, distance=1.5):
    """Return cameras around CENTRE, in a world with z up."""
    cameras = []
    for number in range(count):
        pose = orbit_camera(number * 2 * math.pi / count, 0.25 + 0.15 * (number % 3),
                            distance).pose.copy()
        pose[:3, 3] += CENTRE
        cameras.append(Camera(pose, lens))
    return cameras


def names(cameras):
    return [f'photo{number}.png' for number in range(len(cameras))]


def blank_photos(folder, cameras, value=90):
    """Write a photo of one colour for each camera, each of another one."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, (name, camera) in enumerate(zip(names(cameras), cameras, strict=True)):
        size = camera.intrinsics.height, camera.intrinsics.width, 3
        Image.fromarray(np.full(size, value + number, np.uint8)).save(folder / name)
    return folder


def transforms(cameras, shared=True, suffix=True):
    """Return the content of transforms.json, as nerfstudio and instant-ngp write it."""
    content = {'frames': []}
    for name, camera in zip(names(cameras), cameras, strict=True):
        lens = camera.intrinsics
        own = {'fl_x': lens.fx, 'fl_y': lens.fy, 'cx': lens.cx, 'cy': lens.cy, 'w': lens.width,
               'h': lens.height, **(dict(zip(('k1', 'k2', 'p1', 'p2'),
                                             lens.distortion.coefficients, strict=True))
                                    if lens.distortion else {})}
        frame = {'file_path': f'./images/{name if suffix else name.removesuffix(".png")}',
                 'transform_matrix': (camera.pose @ OPENGL).tolist()}
        content['frames'].append(frame if shared else {**frame, **own})
        if shared:
            content.update(own)
    return content


def write_transforms(path, cameras, **how):
    path.write_text(json.dumps(transforms(cameras, **how)))
    return path


def write_opencv(path, cameras, named=True):
    """Write cameras by OpenCV itself."""
    lens = cameras[0].intrinsics
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    matrix = lens.matrix
    matrix[:2, 2] -= 0.5
    storage.write('camera_matrix', matrix)
    storage.write('distortion_coefficients', np.array(
        lens.distortion.coefficients if lens.distortion else [0.0] * 4)[:, None])
    storage.write('image_width', lens.width)
    storage.write('image_height', lens.height)
    rows = [np.concatenate([cv2.Rodrigues(inverse[:3, :3])[0].ravel(), inverse[:3, 3]])
            for inverse in (np.linalg.inv(camera.pose) for camera in cameras)]
    if named:
        storage.startWriteStruct('images', cv2.FileNode_SEQ)
        for name, row in zip(names(cameras), rows, strict=True):
            storage.startWriteStruct('', cv2.FileNode_MAP)
            storage.write('name', name)
            storage.write('rvec', row[:3])
            storage.write('tvec', row[3:])
            storage.endWriteStruct()
        storage.endWriteStruct()
    else:
        storage.write('extrinsic_parameters', np.array(rows))
    storage.release()
    return path


def write_middlebury(path, cameras):
    lines = [str(len(cameras))]
    for name, camera in zip(names(cameras), cameras, strict=True):
        lens, inverse = camera.intrinsics.matrix, np.linalg.inv(camera.pose)
        lens[:2, 2] -= 0.5
        numbers = [*lens.ravel(), *inverse[:3, :3].ravel(), *inverse[:3, 3]]
        lines.append(' '.join([name, *(f'{number:.12g}' for number in numbers)]))
    path.write_text('\n'.join(lines) + '\n')
    return path
