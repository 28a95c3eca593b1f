"""The values of the paper's tables as printed, measured on ShapeNet and PASCAL3D+."""

from collections.abc import Mapping

VIEWS = (1, 2, 3, 4, 5)

TABLE1: Mapping[str, Mapping[str, tuple[float, ...]]] = {
    '2D-3D': {
        'loss': (0.138, 0.129, 0.104, 0.090, 0.088),
        'iou': (0.635, 0.639, 0.642, 0.678, 0.688)},
    '2D-3D-attention': {
        'loss': (0.108, 0.091, 0.088, 0.072, 0.064),
        'iou': (0.698, 0.699, 0.704, 0.720, 0.724)},
}
"""Loss and IoU after 1 to 5 views, couch."""

TABLE2_OF = 'PASCAL3D+'
TABLE2: Mapping[tuple[float, float], tuple[float, float]] = {
    (0.0, 1.0): (0.592, 0.523),
    (0.2, 0.8): (0.604, 0.530),
    (0.4, 0.6): (0.606, 0.533),
    (0.5, 0.5): (0.604, 0.529),
    (0.6, 0.4): (0.546, 0.485),
    (0.8, 0.2): (0.505, 0.415),
    (1.0, 0.0): (0.488, 0.462),
}
"""Mean IoU of training and test by lambda_V and lambda_S, motorbike."""

TABLE3_SYSTEMS = ('3D-R2N2', 'OGN', 'PTN', '2D-3D-attention')
TABLE3: Mapping[str, tuple[float, float, float, float]] = {
    'airplane': (0.513, 0.587, 0.553, 0.602),
    'bench': (0.421, 0.481, 0.482, 0.508),
    'cabinet': (0.716, 0.729, 0.711, 0.757),
    'chair': (0.466, 0.483, 0.458, 0.468),
    'car': (0.798, 0.816, 0.712, 0.788),
    'monitor': (0.468, 0.502, 0.535, 0.566),
    'lamp': (0.381, 0.398, 0.354, 0.398),
    'speaker': (0.662, 0.637, 0.586, 0.700),
    'firearm': (0.544, 0.593, 0.582, 0.598),
    'sofa': (0.628, 0.646, 0.643, 0.698),
    'table': (0.513, 0.536, 0.471, 0.624),
    'cellphone': (0.661, 0.702, 0.728, 0.758),
    'watercraft': (0.513, 0.632, 0.536, 0.532),
}
"""IoU of a single view by category, of TABLE3_SYSTEMS in their order."""

TABLE4: Mapping[str, tuple[float, float]] = {
    'pre-processing data': (0.455, 11.34),
    'loading models': (2.774, 69.13),
    'making prediction': (0.516, 12.85),
    'preserving outputs': (0.268, 6.68),
}
TABLE4_TOTAL = 4.013
"""Seconds and percentage of the steps of a single-view reconstruction, and their sum."""

TABLE5_VIEWS = (1, 3, 5)
TABLE5_OF = 'PASCAL3D+'
TABLE5: Mapping[str, tuple[float, float, float]] = {
    'bookshelf': (0.369, 0.417, 0.515),
    'bed': (0.140, 0.217, 0.228),
    'motorbike': (0.281, 0.362, 0.514),
}
"""
IoU after 1, 3 and 5 views of categories that were not trained on.

The paper says that they are of PASCAL3D+, which has no beds and no bookshelves.
"""
