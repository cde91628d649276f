"""Fuses a recording of skeletons with files of IMUs' raw samples, without ROS.

python examples/fuse_with_imus.py walking_positions_3d.csv.gz right_shank=walking_RF.csv.gz

Each file is a CSV with a header: a time (UNIX seconds, or a date and time), Acc_X, Acc_Y, Acc_Z
[m/s²] and Gyr_X, Gyr_Y, Gyr_Z [deg/s], as Xsens DOT writes it; for other files change read_imu. The
IMUs' clock may be off by seconds: the offset is found from the motion. Needs the package vqf.
"""

import argparse
import csv
import gzip
import sys
from collections.abc import Iterable, Iterator
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from vqf import VQF

from pose_calibration.session_calibration import calibrate
from pose_core.api import (
    JOINT_INDEX,
    BodyEstimate,
    Clock,
    ImuSample,
    Pipeline,
    PipelineParameters,
    PoseError,
    SkeletonSample,
    in_order,
    run_first_pass,
)
from pose_core.joints import LIMB_ENDS
from pose_io.samples import read_samples

SETTLED_NS = 5 * 10**9  # [ns] from the recording's begin, after which rates are compared
UNKNOWN_HEADING = (0.02, 0.02, np.pi)  # [rad] deviations about the world's axes: no magnetometer


def read_imu(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], accelerations [m/s²] and angular velocities [rad/s] of a file."""
    packed = path.read_bytes()
    text = (gzip.decompress(packed) if path.suffix == ".gz" else packed).decode()
    _, *rows = csv.reader(text.splitlines())
    rows = [row for row in rows if any(float(value) for value in row[1:7])]  # no empty samples
    times_s = np.array([seconds(row[0]) for row in rows])
    values = np.array([row[1:7] for row in rows], np.float64)
    return times_s, values[:, :3].copy(), np.radians(values[:, 3:])


def seconds(text: str) -> float:
    """A time in seconds, of a number or of a date."""
    try:
        return float(text)
    except ValueError:
        return datetime.fromisoformat(text).replace(tzinfo=timezone.utc).timestamp()


def imu_samples(segment: str, path: Path, begin_ns: int) -> Iterator[ImuSample]:
    """Samples with orientations, the first at an instant [ns]."""
    times_s, acceleration, rate = read_imu(path)
    period_s = float(np.median(np.diff(times_s)))
    filtered = VQF(period_s).updateBatch(np.ascontiguousarray(rate), acceleration)
    w_first = filtered["quat6D"]
    for row, time_s in enumerate(times_s - times_s[0]):
        yield ImuSample(
            stamp_ns=begin_ns + round(time_s * 1e9),
            segment=segment,
            orientation=np.roll(w_first[row], -1),  # x, y, z, w
            orientation_stddev=np.array(UNKNOWN_HEADING),
            angular_velocity=rate[row],
            linear_acceleration=acceleration[row],
        )


def fused(
    samples: Iterable[SkeletonSample | ImuSample], sensors: tuple[str, ...]
) -> tuple[Pipeline, list[BodyEstimate]]:
    """Calibrate from the motion, and fuse as ``./pose fuse`` does: aligned IMUs from the start."""
    ordered = sorted(samples, key=lambda sample: sample.stamp_ns)
    extrinsics = calibrate(ordered, sensors).extrinsics
    parameters = PipelineParameters(sensors=sensors)
    parameters, alignments = run_first_pass(ordered, extrinsics, parameters)
    pipeline = Pipeline(parameters, extrinsics)
    pipeline.use_sensor_to_segment(alignments)
    on_one_clock = in_order(ordered, extrinsics.clocks)
    estimates = [each for sample in on_one_clock for each in pipeline.add(sample)]
    return pipeline, [*estimates, *pipeline.flush()]


def rate_agreement(
    pipeline: Pipeline, estimates: list[BodyEstimate], imu: list[ImuSample]
) -> tuple[float, float]:
    """A limb's fused rate and its gyroscope's: correlation [-], RMS difference [deg/s]."""
    segment = imu[0].segment
    axis = pipeline.sensor_to_segment[segment].R_sensor_segment[:, 2]
    measured = np.array([each.angular_velocity for each in imu])
    across = np.linalg.norm(measured - np.outer(measured @ axis, axis), axis=1)
    clock = pipeline.clocks.get("imus", Clock())
    times_ns = np.array([clock.to_reference(each.stamp_ns) for each in imu])
    at_ns = np.array([each.stamp_ns for each in estimates])
    start, end = (JOINT_INDEX[joint] for joint in LIMB_ENDS[segment])
    bone = np.stack([each.joints[end] - each.joints[start] for each in estimates])
    direction = bone / np.linalg.norm(bone, axis=1)[:, None]
    fused_rate = np.linalg.norm(np.gradient(direction, at_ns * 1e-9, axis=0), axis=1)
    common = (at_ns > max(times_ns[0], at_ns[0] + SETTLED_NS)) & (at_ns < times_ns[-1])
    rate = np.interp(at_ns[common], times_ns, across)
    difference = float(np.degrees(np.sqrt(np.mean((rate - fused_rate[common]) ** 2))))
    return float(np.corrcoef(rate, fused_rate[common])[0, 1]), difference


def main(recording: str, imus: dict[str, Path]) -> None:
    """Fuse a recording with files of IMUs, by segment."""
    recorded = read_samples(recording)
    skeletons = list(recorded.samples)
    begin_ns = skeletons[0].stamp_ns
    read = {name: list(imu_samples(name, path, begin_ns)) for name, path in imus.items()}
    samples = [*skeletons, *(each for imu in read.values() for each in imu)]
    pipeline, estimates = fused(samples, tuple(recorded.sensors))
    print(f"{len(estimates)} poses")
    for source, clock in pipeline.clocks.items():
        print(f"the clock of {source} is {clock.offset_ns * 1e-9:+.3f} s ahead")
    for use in pipeline.imu_uses:
        print(use)
        if use.is_aligned and use.segment in LIMB_ENDS:
            correlation, apart = rate_agreement(pipeline, estimates, read[use.segment])
            print(f"its rate and the fused one: r = {correlation:.2f}, {apart:.0f} deg/s apart")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", help="skeletons, or a bag: src/kinect_bridge/README.md")
    parser.add_argument("imu", nargs="+", help="segment=file, for example right_shank=RF.csv.gz")
    arguments = parser.parse_args()
    try:
        pairs = (each.partition("=") for each in arguments.imu)
        main(arguments.recording, {segment: Path(file) for segment, _, file in pairs})
    except (PoseError, OSError) as error:
        sys.exit(str(error))
