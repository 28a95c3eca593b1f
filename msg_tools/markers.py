"""A surface to and from a Marker: a list of triangles, with a colour for each corner."""

from active_recon.errors import MessageError
from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

NAMESPACE = 'mesh'
_GREY = (0.7, 0.7, 0.72)


def surface_to_msg(vertices: NDArray[np.floating], faces: NDArray[np.integer],
                   colors: NDArray[np.uint8] | None, header: Header) -> Marker:
    """
    Return the triangles of a surface.

    `vertices` are (V, 3) metres, `faces` (F, 3) indices, `colors` (V, 3) uint8 RGB; None is grey.
    """
    # Corners of several faces are one object: creating one costs more than all the rest
    points = [Point(x=x, y=y, z=z) for x, y, z in np.asarray(vertices, np.float64).tolist()]
    shades = [] if colors is None else [
        ColorRGBA(r=r, g=g, b=b, a=1.0) for r, g, b in (colors / 255).tolist()]
    order = np.asarray(faces).ravel().tolist()
    marker = Marker(header=header, ns=NAMESPACE, type=Marker.TRIANGLE_LIST, action=Marker.ADD,
                    scale=Vector3(x=1.0, y=1.0, z=1.0),
                    color=ColorRGBA(r=_GREY[0], g=_GREY[1], b=_GREY[2], a=1.0),
                    points=[points[index] for index in order],
                    colors=[shades[index] for index in order] if shades else [])
    marker.pose.orientation.w = 1.0
    return marker


def surface_from_msg(msg: Marker) -> tuple[NDArray[np.float64], NDArray[np.uint8] | None]:
    """
    Return triangles (F, 3, 3) in metres, and their corners' colours (F, 3, 3) uint8 RGB or None.

    Raises MessageError where it is no list of triangles, or its colours are not one a corner.
    """
    if msg.type != Marker.TRIANGLE_LIST or len(msg.points) % 3:
        raise MessageError('no surface: expected a Marker of the type TRIANGLE_LIST with three '
                           f'points a triangle, got type {msg.type} with {len(msg.points)}',
                           'mesh')
    if len(msg.colors) not in (0, len(msg.points)):
        raise MessageError(f'wrong number of colours: expected {len(msg.points)} or none, got '
                           f'{len(msg.colors)}', 'mesh')
    triangles = np.array([(point.x, point.y, point.z) for point in msg.points]).reshape(-1, 3, 3)
    if not msg.colors:
        return triangles, None
    shades = np.array([(shade.r, shade.g, shade.b) for shade in msg.colors])
    if not ((shades >= 0) & (shades <= 1)).all():
        raise MessageError('invalid colours: expected red, green and blue in [0, 1], got up to '
                           f'{shades.max()}', 'mesh')
    return triangles, np.rint(255 * shades).astype(np.uint8).reshape(-1, 3, 3)


def no_surface_to_msg(header: Header) -> Marker:
    """Return what removes the surface from displays."""
    return Marker(header=header, ns=NAMESPACE, type=Marker.TRIANGLE_LIST, action=Marker.DELETE)
