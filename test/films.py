"""Video files, and what can be told of each of their images."""

import cv2
import numpy as np

SIZE = (64, 48)


def film(path, count=8, rate=50.0, size=SIZE):
    """Write a video whose images turn from black to red; return the path."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), rate, size)
    for number in range(count):
        image = np.zeros((size[1], size[0], 3), np.uint8)
        image[..., 2] = shade(number, count)  # OpenCV's order is blue, green, red
        writer.write(image)
    writer.release()
    return path


def shade(number, count=8):
    return 255 * number // (count - 1)
