"""One Azure Kinect and a real IMU with a clock of its own (HPI-CH/sevivi); its place is unknown."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from pose_core.api import JOINT_INDEX
from pose_io.samples import read_samples

pytestmark = pytest.mark.data

EXAMPLE = Path(__file__).parents[3] / "examples" / "fuse_with_imus.py"
SETTLED_NS = 5 * 10**9  # [ns] from the recording's begin


def example():
    spec = importlib.util.spec_from_file_location("fuse_with_imus", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rate_agreement(estimates, times_ns, rate, joints):
    """Correlation of the rates of a limb's direction, as fused and by a gyroscope."""
    start, end = (JOINT_INDEX[joint] for joint in joints)
    at_ns = np.array([each.stamp_ns for each in estimates])
    bone = np.stack([each.joints[end] - each.joints[start] for each in estimates])
    direction = bone / np.linalg.norm(bone, axis=1)[:, None]
    fused = np.linalg.norm(np.gradient(direction, at_ns * 1e-9, axis=0), axis=1)
    common = (at_ns > times_ns[0]) & (at_ns < times_ns[-1]) & (at_ns > at_ns[0] + SETTLED_NS)
    measured = np.interp(at_ns[common], times_ns, rate)
    return np.corrcoef(measured, fused[common])[0, 1]


@pytest.mark.parametrize(
    ("motion", "segment", "joints", "offset_s", "alone"),
    [
        ("walking", "right_shank", ("right_knee", "right_foot"), 4.14, 0.55),
        ("3d_hand_movement", "right_forearm", ("right_elbow", "right_hand"), 4.88, 0.75),
    ],
)
def test_clock_and_alignment_are_found_and_the_fused_rates_are_the_gyroscopes(
    shared_data, motion, segment, joints, offset_s, alone
):
    folder, files = shared_data / "azure_imu", example()
    recorded = read_samples(folder / f"{motion}_positions_3d.csv.gz")
    skeletons, sensors = list(recorded.samples), tuple(recorded.sensors)
    imu = list(files.imu_samples(segment, folder / f"{motion}_RF.csv.gz", skeletons[0].stamp_ns))
    pipeline, estimates = files.fused([*skeletons, *imu], sensors)

    assert pipeline.clocks["imus"].offset_ns * 1e-9 == pytest.approx(offset_s, abs=0.05)
    (use,) = pipeline.imu_uses
    assert use.is_aligned
    assert use.frames_used > 0.7 * use.frames

    axis = pipeline.sensor_to_segment[segment].R_sensor_segment[:, 2]
    rates = np.array([each.angular_velocity for each in imu])
    across = np.linalg.norm(rates - np.outer(rates @ axis, axis), axis=1)
    times_ns = np.array([each.stamp_ns for each in imu]) - pipeline.clocks["imus"].offset_ns
    assert rate_agreement(estimates, times_ns, across, joints) > 0.85
    camera_alone = files.fused(skeletons, sensors)[1]
    assert rate_agreement(camera_alone, times_ns, across, joints) < alone
