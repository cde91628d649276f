"""A body that a fusion has published, with the topics of its IMUs and the fusion's reports."""

import numpy as np
from moving_body import motion
from session_bag import diagnostics, imu, skeleton

from pose_core.streams.samples import ImuSample
from pose_io.bag_writer import BagWriter
from pose_io.topics import IMU

S = 1_000_000_000


def write_fused_bag(path, reports, imu_topics=(), silent=()):
    """Write it; reports by time [s]: the name of a status, and its values by key."""
    series = motion(rate=30.0, duration_s=6.0)
    with BagWriter(path) as bag:
        for topic in silent:
            bag.add_topic(topic, IMU)
        for stamp_ns, joints in zip(series.stamps_ns.tolist(), series.positions, strict=True):
            body = skeleton(stamp_ns, joints, np.full(15, 2))
            bag.write("/humans/bodies/subject/skeleton", body, stamp_ns)
            for topic in imu_topics:
                bag.write(topic, imu(still(stamp_ns)), stamp_ns)
        for time_s, (name, values) in reports.items():
            stamp_ns = round(time_s * S)
            bag.write("/diagnostics", diagnostics(stamp_ns, name, values), stamp_ns)
    return path


def still(stamp_ns):
    """A sample of an IMU at rest."""
    return ImuSample(
        stamp_ns=stamp_ns,
        segment="torso",
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        orientation_stddev=np.full(3, 0.02),
        angular_velocity=np.zeros(3),
        linear_acceleration=np.array([0.0, 0.0, 9.8]),
    )
