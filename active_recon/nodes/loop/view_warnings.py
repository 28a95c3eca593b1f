"""Warns of views that a network reconstructs worse from, in its node's diagnostics."""

import math

from active_recon.acquisition.background import main_part_share, WHOLE_SHARE
from active_recon.geometry.cameras import Camera, CANONICAL_ELEVATION, ELEVATION_TOLERANCE
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.quality.quality import Quality
from active_recon.reconstructor import Reconstruction
from active_recon.volumes.better_cube import better_cube
import numpy as np
from numpy.typing import NDArray


class ViewWarnings:
    """Warns of an unusual elevation, the cube, an object in pieces, and unusual views."""

    def __init__(self, diagnostics: Diagnostics, needs_front: bool) -> None:
        self._diagnostics, self._needs_front = diagnostics, needs_front

    def clear(self) -> None:
        """Forget the views: an episode begins."""
        self._diagnostics.drop_value('Quality')
        self._diagnostics.clear_warning('unusual_views', log=False)
        self._diagnostics.clear_warning('cube', log=False)

    def check_elevation(self, camera: Camera) -> None:
        """Warn where a network that needs the object's front knows one elevation only."""
        away = camera.elevation - CANONICAL_ELEVATION
        if self._needs_front and abs(away) > ELEVATION_TOLERANCE:
            self._diagnostics.warn('elevation', (
                'wrong elevation of the camera: expected 30 degrees, as the network was trained '
                f'with, got {math.degrees(camera.elevation):.1f}; the reconstruction will be '
                'worse'))

    def check_shape(self, known: Reconstruction, threshold: float, views: int) -> None:
        """Show the quality; warn of unusual views, and of a cube that does not fit."""
        self._check_quality(known.quality)
        better = better_cube(known.grid, threshold, views)
        if better is None:
            self._diagnostics.clear_warning('cube')
        else:
            self._diagnostics.raise_warning('cube', better.warning)

    def _check_quality(self, quality: Quality | None) -> None:
        if quality is None:
            return
        self._diagnostics.set_value('Quality', quality.summary, at_once=False)
        if quality.suspect:
            self._diagnostics.raise_warning('unusual_views', quality.warning)
        else:
            self._diagnostics.clear_warning('unusual_views')

    def check_background(self, image: NDArray[np.uint8]) -> None:
        """Warn where the removal of the background has cut the object into pieces."""
        share = main_part_share(image)
        if share < WHOLE_SHARE:
            self._diagnostics.warn('background', (
                'the object is in pieces once its background is removed, the largest of them '
                f'{share:.0%} of it: is part of the object of the same colour as the background? '
                'see view_image; a mask or another background colour may help'))
