"""Samples as bags of the live graph and of pose_sim."""

import numpy as np

from pose_core.streams.samples import ImuSample
from pose_io.bag_writer import BagWriter
from pose_io.message_maker import MessageMaker
from pose_io.typestore import make_typestore

MAKE = MessageMaker(make_typestore())
TRUTH = "/truth/humans/bodies/subject/skeleton"
SYNTHETIC = "synthetic: no person, made for a test"


def skeleton(stamp_ns, positions, state, frame="map", person="1"):
    header = MAKE.header(int(stamp_ns), frame)
    return MAKE.skeleton(header, person, np.nan_to_num(positions), np.asarray(state, np.uint8))


def imu(sample):
    return MAKE.imu(
        MAKE.header(sample.stamp_ns, f"imu_{sample.segment}_link"),
        sample.orientation,
        sample.orientation_stddev,
        sample.angular_velocity,
        np.nan_to_num(sample.linear_acceleration),
    )


def diagnostics(stamp_ns, name, values):
    """A node's report, its values by key."""
    pairs = [MAKE.make("diagnostic_msgs/KeyValue", key=k, value=v) for k, v in values.items()]
    status = MAKE.make(
        "diagnostic_msgs/DiagnosticStatus",
        level=0,
        name=name,
        message="",
        hardware_id="",
        values=pairs,
    )
    header = MAKE.header(int(stamp_ns))
    return MAKE.make("diagnostic_msgs/DiagnosticArray", header=header, status=[status])


def comment(stamp_ns, text):
    """What kinect_bridge repeats of its recording in its diagnostics."""
    return diagnostics(stamp_ns, "/kinect_left", {"comment": text})


def write_session(path, samples, T_map_sensor=None, text=SYNTHETIC):
    """What went into the fusion, in the order of its stamps."""
    samples = sorted(samples, key=lambda sample: sample.stamp_ns)
    with BagWriter(path) as bag:
        if T_map_sensor:
            bag.write("/tf_static", MAKE.sensor_transforms(T_map_sensor, 0), samples[0].stamp_ns)
        if text:
            bag.write("/diagnostics", comment(samples[0].stamp_ns, text), samples[0].stamp_ns)
        for sample in samples:
            if isinstance(sample, ImuSample):
                bag.write(f"/imu_{sample.segment}/data", imu(sample), sample.stamp_ns)
                continue
            frame = f"kinect_{sample.sensor}_optical_frame"
            seen = skeleton(
                sample.stamp_ns, sample.positions, sample.tracking_state, frame, sample.person
            )
            message = MAKE.skeletons(seen.header, [seen])
            bag.write(f"/kinect_{sample.sensor}/skeletons", message, sample.stamp_ns)
    return path


def write_truth(path, series):
    """A synthetic subject's truth."""
    with BagWriter(path) as bag:
        about = MAKE.make("std_msgs/String", data=SYNTHETIC)
        bag.write("/truth/about", about, int(series.stamps_ns[0]))
        for stamp_ns, positions, state in zip(
            series.stamps_ns, series.positions, series.tracking_state, strict=True
        ):
            bag.write(TRUTH, skeleton(stamp_ns, positions, state), int(stamp_ns))
    return path
