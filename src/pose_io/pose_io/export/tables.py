"""Plain text for spreadsheets and programs: CSV, and the body-pose stream as JSON lines.

Both keep every instant with its own stamp.
"""

import csv
import io
import json

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray, without_sign_changes
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_io.export.exporter import Exporter
from pose_io.export.motion import BodyMotion
from pose_io.names import WORLD_FRAME

METRES = 3  # number of leading degrees of freedom that are lengths


def motion_csv(motion: BodyMotion) -> str:
    """One row per instant; each column's name ends in its unit.

    ``stamp_ns``, ``time_s``; every degree of freedom and its standard deviation; joint positions;
    segment poses (quaternion x, y, z, w). What is unknown is left empty: joints, angles, and the
    quaternions that depend on such an angle.
    """
    units = ["m" if i < METRES else "deg" for i in range(motion.model.size)]
    scale = np.where(np.arange(motion.model.size) < METRES, 1.0, np.degrees(1.0))
    names = list(zip(motion.model.dof_names, units, strict=True))
    segments = segment_poses(motion)
    header = [
        "stamp_ns",
        "time_s",
        *(f"{name}_{unit}" for name, unit in names),
        *(f"{name}_stddev_{unit}" for name, unit in names),
        *(f"{joint}_{axis}_m" for joint in JOINTS for axis in "xyz"),
        *(f"segment_{name}_{axis}_m" for name in segments for axis in "xyz"),
        *(f"segment_{name}_q{axis}" for name in segments for axis in "xyzw"),
    ]
    count = len(motion)
    poses = list(segments.values())
    links = [motion.model.link_names.index(name) for name in motion.model.segments.values()]
    unknown = motion.is_turn_unknown[:, links].T[..., None]
    columns = [
        motion.times_s[:, None],
        np.where(motion.is_unknown, np.nan, motion.dof * scale),
        motion.stddev * scale,
        motion.joints.reshape(count, -1),
        *(position for position, _ in poses),
        *(np.where(n, np.nan, turn) for n, (_, turn) in zip(unknown, poses, strict=True)),
    ]
    rows = np.concatenate(columns, axis=1)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for stamp, row in zip(motion.stamps_ns.tolist(), rows, strict=True):
        values = ("" if value != value else f"{value:.6f}" for value in row.tolist())
        writer.writerow([stamp, *values])
    return text.getvalue()


def json_lines_text(motion: BodyMotion) -> str:
    """One JSON object per line: position and orientation of each segment in ``map``.

    Instants that are interpolated across a gap of the recording are left out.
    """
    poses = {
        name: (position.round(6).tolist(), quaternion.round(7).tolist())
        for name, (position, quaternion) in segment_poses(motion).items()
    }
    lines = []
    for index, stamp in enumerate(motion.stamps_ns.tolist()):
        if motion.is_gap[index]:
            continue
        segments = {
            name: {"position": positions[index], "quaternion": quaternions[index]}
            for name, (positions, quaternions) in poses.items()
        }
        line = {"stamp_ns": stamp, "frame_id": WORLD_FRAME, "body": motion.body}
        lines.append(json.dumps({**line, "segments": segments}))
    return "\n".join(lines) + "\n"


def segment_poses(motion: BodyMotion) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Position [m], (n, 3), and quaternion x, y, z, w, (n, 4), of each segment in map.

    A segment's origin is the joint about which it rotates; the root's is midway between the hips.
    Several segments may belong to one link, such as pelvis and torso of a rigid trunk.
    """
    poses = {}
    for segment, link_name in motion.model.segments.items():
        joint = motion.model.links[link_name].joint
        rotations = motion.pose.rotations[:, motion.model.link_names.index(link_name)]
        position = motion.dof[:, :METRES] if joint is None else motion.joints[:, JOINT_INDEX[joint]]
        poses[segment] = (position, without_sign_changes(Rotation.from_matrix(rotations).as_quat()))
    return poses


CSV = Exporter(
    doc="angles, joints and segments, for spreadsheets",
    content=lambda motion, _: motion_csv(motion).encode(),
    constant_rate=False,
    unknown_angles="their cells are empty",
)
JSON_LINES = Exporter(
    doc="JSON lines {segment: position, quaternion}, for robot retargeting",
    content=lambda motion, _: json_lines_text(motion).encode(),
    constant_rate=False,
    unknown_angles="they are interpolated",
)
