"""Tables of float32 columns to and from PointCloud2."""

import array
from collections.abc import Sequence

from active_recon.errors import MessageError
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

_TYPES = {getattr(PointField, name.upper()): name for name in (
    'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'float32', 'float64')}


def cloud_from_msg(msg: PointCloud2, names: Sequence[str]) -> NDArray[np.float32]:
    """
    Return the named float32 fields of a cloud, (N, len(names)).

    Raises MessageError if a field is missing or not float32, or the data is too short.
    """
    offsets = {field.name: field.offset for field in msg.fields
               if field.datatype == PointField.FLOAT32}
    if missing := [name for name in names if name not in offsets]:
        types = {field.name: field.datatype for field in msg.fields}
        got = [f'{name} in {_TYPES.get(types[name], types[name])}' for name in missing
               if name in types]
        if absent := [name for name in missing if name not in types]:
            got.append(f'none named {", ".join(absent)}')
        raise MessageError(f'missing cloud fields: expected float32 fields {", ".join(names)}, '
                           f'got {", ".join(got)}', 'cloud')
    count = msg.width * msg.height
    row_bytes = msg.width * msg.point_step
    step = max(msg.row_step, row_bytes) if msg.height > 1 else row_bytes
    if len(msg.data) < msg.height * step:
        raise MessageError(f'cloud too short: expected {msg.height * step} bytes for {count} '
                           f'points, got {len(msg.data)}', 'cloud')
    if any(offsets[name] + 4 > msg.point_step for name in names):
        raise MessageError(f'invalid cloud fields: expected them within {msg.point_step} bytes, '
                           f'got offsets {offsets}', 'cloud')
    order = '>' if msg.is_bigendian else '<'
    row = np.dtype({'names': list(names), 'formats': [f'{order}f4'] * len(names),
                    'offsets': [offsets[name] for name in names], 'itemsize': msg.point_step})
    data = msg.data if step == row_bytes else np.frombuffer(
        msg.data, np.uint8, msg.height * step).reshape(msg.height, step)[:, :row_bytes].tobytes()
    table = np.frombuffer(data, row, count)
    if row == np.dtype([(name, '<f4') for name in names]):  # no other fields, in this order
        return table.view('<f4').reshape(count, len(names))
    return np.column_stack([table[name] for name in names]).astype(np.float32)


def cloud_to_msg(table: NDArray[np.float32], names: Sequence[str], header: Header) -> PointCloud2:
    """Return a table, (N, len(names)) float32, as an unordered cloud."""
    count, columns = table.shape
    fields = [PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
              for index, name in enumerate(names)]
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(table, np.float32).reshape(-1).view(np.uint8).data)
    return PointCloud2(header=header, height=1, width=count, fields=fields, is_bigendian=False,
                       point_step=4 * columns, row_step=4 * columns * count, data=data,
                       is_dense=bool(np.isfinite(table).all()))
