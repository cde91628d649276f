"""C3D (c3d.org): the joints as points [mm] in ``map``, z up, written by the library c3d."""

import io
import warnings

import numpy as np

from pose_core.joints import JOINTS
from pose_io.c3d_library import c3d_library
from pose_io.export.exporter import Exporter
from pose_io.export.motion import BodyMotion

MM = 1000.0  # [mm/m]
UNKNOWN = -1.0  # residual of a point that is not known


def c3d_bytes(motion: BodyMotion, rate: float) -> bytes:
    """The file's content, at the constant rate [Hz]; unknown points are invalid."""
    writer = c3d_library().Writer(point_rate=rate, point_units="mm")
    writer.set_point_labels(list(JOINTS))
    writer.set_screen_axis("+X", "+Z")
    known = np.asarray(np.isfinite(motion.joints).all(axis=2))
    points = np.zeros((len(motion), len(JOINTS), 5))  # x, y, z, residual, cameras
    points[..., :3] = np.where(known[..., None], motion.joints * MM, 0.0)
    points[..., 3] = np.where(known, 0.0, UNKNOWN)
    no_analog = np.zeros((0, 0))
    for frame in points:
        writer.add_frames([(frame, no_analog)])
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "No analog data")  # there is no analogue data
        writer.write(buffer)
    return buffer.getvalue()


C3D = Exporter(
    doc="joints as points, for biomechanics programs",
    content=lambda motion, options: c3d_bytes(motion, options.rate),
)
